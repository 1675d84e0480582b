"""The meshes of a case, with checks of the surfaces and regions that the case names, for `check` and a run.

Nothing here needs a finite element.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case
from fsci.case.checks import VECTORS, vectors_of
from fsci.case.free_checks import free_mistakes
from fsci.case.mesh import FileMesh
from fsci.case.mesh import Mesh as MeshSection
from fsci.case.solid_order import chooses_order, with_order
from fsci.case.structure import NO_MIXED_SIMPLICES
from fsci.meshes.checksum import mesh_checksum
from fsci.meshes.finite_values import require_finite
from fsci.meshes.locations import find_locations
from fsci.meshes.mesh import MeshError, build_mesh, extract_region, require_surface
from fsci.meshes.slender import is_slender
from fsci.meshes.valid import BadMesh, require_positive, require_valid
from solvers.fluid.grid.box import FLUSH
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.tessellation import is_closed, tessellate
from solvers.mesh.topology import surface_facets

Array = NDArray[np.float64]
Keys = tuple[str | int, ...]
T = TypeVar("T")


_READ: ContextVar[dict[Any, Any] | None] = ContextVar("meshes that are read once", default=None)


@contextmanager
def reading_once() -> Iterator[None]:
    """Within it, each mesh of a case is read and checked once."""
    token = _READ.set({})
    try:
        yield
    finally:
        _READ.reset(token)


def _once(read: Callable[[Case, str], T]) -> Callable[[Case, str], T]:
    """A function whose results are kept within `reading_once`: of a mesh that it raises nothing for."""

    @wraps(read)
    def reading(case: Case, name: str) -> T:
        kept = _READ.get()
        if kept is None:
            return read(case, name)
        # pairs that are found later name surfaces that have to be there
        key = (read.__name__, name, None if case.contact is None else id(case.contact))
        if key not in kept:
            kept[key] = read(case, name), case.contact
        return kept[key][0]  # type: ignore[no-any-return]

    return reading


@_once
def read_body(case: Case, name: str) -> Mesh:
    """The mesh of an elastic body, or its region, with everything in it that the case names. Raises CaseError."""
    settings = case.elastic_bodies[name]
    keys: Keys = ("structure", "bodies", name, "mesh")
    try:
        mesh = _elastic_mesh(case, name, with_order(case, name))
        _require_dimension(case, name, mesh)
        if CELL_TYPES[mesh.cell_type].degree == 1 and chooses_order(settings.mesh):
            slender, fitted = is_slender(mesh), _is_fitted(case, name, mesh)
            if (chosen := with_order(case, name, slender=slender, fitted=fitted)).order == 2:
                mesh = _elastic_mesh(case, name, chosen)
        _require_valid(settings.mesh, mesh, parts_meet=_meets_itself(case, name))
        if settings.element == "mixed" and mesh.cell_type[:4] in ("tria", "tetr"):
            keys = ("structure", "bodies", name, "element")
            raise MeshError(NO_MIXED_SIMPLICES)
        for keys, surface in _named_surfaces(case, name):
            require_surface(mesh, surface)
            if keys[0] == "contact":
                surface_facets(mesh, surface)
    except (MeshError, ValueError) as error:
        raise case.error((*keys, *getattr(error, "keys", ())), str(error)) from None
    case.meshes[f"structure.bodies.{name}"] = mesh_checksum(mesh)
    _check_lengths(case, name, mesh.points.shape[1])
    require_finite(case, name, mesh, find_locations(case, name, mesh))
    return mesh


def degree_of_cells(case: Case, name: str) -> int:
    """Degree of the cells of an elastic body, 1 or 2. Raises CaseError."""
    return CELL_TYPES[read_body(case, name).cell_type].degree


def _elastic_mesh(case: Case, name: str, settings: MeshSection) -> Mesh:
    """The mesh of a body, or its region. Raises MeshError."""
    mesh, region = build_mesh(settings, case.folder), case.elastic_bodies[name].region
    if region is None:
        return mesh
    try:
        return extract_region(mesh, region)
    except MeshError as error:
        raise case.error(("structure", "bodies", name, "region"), str(error)) from None


def _is_fitted(case: Case, name: str, mesh: Mesh) -> bool:
    """Whether an elastic body has contact by interference only, on surfaces without an end."""
    if case.contact is None or case.contact.bodies is not None:
        return False
    pairs = [pair for pair in case.contact.pairs.values() if name in {side.body for _, side in pair.sides}]
    surfaces = [side.on for pair in pairs for _, side in pair.sides if side.body == name]
    closed = all(is_closed(tessellate(mesh, on)[0]) for on in surfaces)
    return closed and all(pair.interference is not None for pair in pairs)


def _require_valid(settings: MeshSection, mesh: Mesh, *, parts_meet: bool = False) -> None:
    """Raises MeshError for a mesh with wrong cells. Those of built-in shapes may be too coarse for their curvature."""
    try:
        if mesh.cones:
            return
        if isinstance(settings, FileMesh):
            require_valid(mesh, parts_meet=parts_meet)
        else:
            require_positive(mesh, "take more cells, or other ones: 'order: 1', or no simplices")
    except BadMesh as error:
        source = settings.file if isinstance(settings, FileMesh) else settings.shape
        raise MeshError(f"{source}: {error}") from None


def _meets_itself(case: Case, name: str) -> bool:
    """Whether surfaces of a body are in contact with each other."""
    pairs = () if case.contact is None else case.contact.pairs.values()
    return any({side.body for _, side in pair.sides} == {name} for pair in pairs)


def _require_dimension(case: Case, name: str, mesh: Mesh) -> None:
    dim = mesh.points.shape[1]
    if case.dimension not in (None, dim):
        other = "the grid" if case.fluid is not None else "another body"
        raise case.error(("structure", "bodies", name, "mesh"), f"the mesh is {dim}D, but {other} is {case.dimension}D")


def slave_surfaces(case: Case, name: str) -> list[str]:
    """The pairs of a body that are not tied."""
    pairs = () if case.contact is None else case.contact.pairs.values()
    slaves = [pair.sides[0][1] for pair in pairs if not pair.tied]
    return [surface for side in slaves if side.body == name for surface in side.on or ()]


def _named_surfaces(case: Case, name: str) -> Iterator[tuple[Keys, str]]:
    """(setting, name) of every surface that contact and probes of a body name."""
    for pair_name, pair in ({} if case.contact is None else case.contact.pairs).items():
        for role, side in dict(pair.sides).items():
            for surface in side.on or () if side.body == name else ():
                yield ("contact", "pairs", pair_name, role, "on"), surface
    for probe_name, probe in case.probes.items():
        if probe.field == "structure" and probe.on is not None and probe.body == name:
            yield ("probes", probe_name, "on"), probe.on


def _check_lengths(case: Case, name: str, dim: int) -> None:
    """Check that vectors have one entry per dimension of the mesh, which is known for files only after reading."""
    body = case.elastic_bodies[name]
    base = ("structure", "bodies", name)
    vectors: list[tuple[Keys, Any]] = [((*base, key), getattr(body, key)) for key in VECTORS]
    vectors += [((*base, *place), vector) for place, vector in vectors_of(body)]
    probes = [(key, p) for key, p in case.probes.items() if p.field == "structure" and p.body == name]
    vectors += [(("probes", key, "at"), p.at) for key, p in probes]
    for keys, vector in vectors:
        if vector is not None and len(vector) != dim:
            raise case.error(keys, f"'{keys[-1]}' has {len(vector)} entries, but the mesh is of {dim} dimensions")


@_once
def read_rigid_body(case: Case, name: str) -> tuple[Mesh, Array, NDArray[np.int64]]:
    """(mesh, points [m], segments or triangles) of a rigid body's closed surface. Raises CaseError."""
    settings, dim = case.rigid_surfaces[name], case.dimension
    base: Keys = settings.keys
    keys = (*base, "mesh")
    try:
        mesh = build_mesh(settings.mesh, case.folder, rigid=True)
        if mesh.points.shape[1] != (dim or mesh.points.shape[1]):
            other = "the grid" if case.fluid is not None else "another body"
            raise MeshError(f"the mesh is {mesh.points.shape[1]}D, but {other} is {dim}D")
        _require_valid(settings.mesh, mesh)
        keys = (*base, "on")
        for surface in settings.on or ():
            require_surface(mesh, surface)
        facets, nodes = tessellate(mesh, settings.on)
        if not is_closed(facets):
            raise MeshError("these surfaces do not enclose the body: name all of them")
    except (MeshError, ValueError) as error:
        raise case.error((*keys, *getattr(error, "keys", ())), str(error)) from None
    case.meshes[".".join(settings.keys)] = mesh_checksum(mesh)
    if dim is None and (free := (case.rigid or {}).get(name)) is not None:
        whole = base if base[0] == "rigid" else (*base, "free")
        for place, message in free_mistakes(free, mesh.points.shape[1], case.moving, whole):
            raise case.error(place, message)
    return mesh, mesh.points[nodes], facets


@_once
def read_obstacle(case: Case, name: str) -> Mesh:
    """The mesh of an obstacle, with the surface that the case names. Raises CaseError."""
    assert case.contact is not None
    obstacle = case.contact.obstacles[name]
    keys: Keys = ("contact", "obstacles", name, "mesh")
    try:
        mesh = build_mesh(obstacle.mesh, case.folder, rigid=True)
        if case.dimension not in (None, mesh.points.shape[1]):
            raise MeshError(f"the mesh is {mesh.points.shape[1]}D, but the bodies are {case.dimension}D")
        _require_valid(obstacle.mesh, mesh, parts_meet=True)
        keys = ("contact", "obstacles", name, "on")
        for surface in obstacle.on or ():
            require_surface(mesh, surface)
            surface_facets(mesh, surface)
    except (MeshError, ValueError) as error:
        raise case.error((*keys, *getattr(error, "keys", ())), str(error)) from None
    case.meshes[f"contact.obstacles.{name}"] = mesh_checksum(mesh)
    return mesh


def read_rigid_side(case: Case, name: str) -> tuple[Mesh, tuple[str, ...] | None]:
    """(mesh, names of its surfaces in contact, None: all) of an obstacle or a rigid body. Raises CaseError."""
    if case.contact is not None and name in case.contact.obstacles:
        return read_obstacle(case, name), case.contact.obstacles[name].on
    return read_rigid_body(case, name)[0], case.rigid_surfaces[name].on


def require_shorter_than_period(case: Case, keys: Keys, points: Array) -> None:
    """Bodies may be anywhere along a period, but as long as it they would meet their images. Raises CaseError."""
    assert case.fluid is not None
    for axis in sorted({face[0] for patch in case.fluid.patches.values() if patch.periodic for face in patch.on}):
        index = "xyz".index(axis)
        planes = case.fluid.grid.edges(index)
        length, period = float(np.ptp(points[:, index])), float(planes[-1] - planes[0])
        if length >= period - FLUSH * float(np.diff(planes).min()):
            message = f"the body must be shorter than the period along {axis}, {period:g}: it has {length:g}"
            raise case.error(keys, message)
