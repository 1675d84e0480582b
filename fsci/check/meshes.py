"""The checks of `fsci check` that read the meshes of a case: mistakes that would stop a run, and warnings.

Meshes are read only where they can tell something: files always, built-in shapes where points or bodies depend on them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from fsci.builder.held import free_motions
from fsci.builder.known_pairs import require_known_pairs
from fsci.builder.skin import find_skin
from fsci.case import Case, CaseError
from fsci.case.contact import PairSection
from fsci.case.errors import Problem
from fsci.case.material import OwnLawSection
from fsci.case.mesh import FileMesh
from fsci.case.plausible_flow import fast_body, thin_body
from fsci.case.rigid_motion import rigid_motion
from fsci.check.scene import Placed, around_box, overlaps, pair_sizes
from fsci.meshes.enclosed import require_outlet
from fsci.meshes.nested import read_grid
from fsci.meshes.of_case import (
    read_body,
    read_obstacle,
    read_rigid_body,
    reading_once,
    require_shorter_than_period,
    slave_surfaces,
)
from solvers.fluid.flow.conservation.cavities import components, enclosed
from solvers.fluid.surfaces.inside import PointInBody, require_outside
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion
from solvers.mesh.locate import locate
from solvers.mesh.mesh import Mesh
from solvers.mesh.tessellation import tessellate
from solvers.mesh.topology import signed_volumes, surface_facets

#: Stress of an undeformed body over its stiffness that is rounding.
STRESS_OF_ROUNDING = 1e-12

Array = NDArray[np.float64]
Keys = tuple[str | int, ...]
T = TypeVar("T")


@dataclass
class Findings:
    """Sizes, mistakes and warnings from the meshes of a case."""

    problems: list[Problem] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    meshes: dict[str, Mesh] = field(default_factory=dict)  #: of elastic bodies that were read
    pairs: dict[str, PairSection] = field(default_factory=dict)  #: of contact, also those that the case does not name
    walls: dict[str, list[str]] = field(default_factory=dict)  #: elastic body -> its pairs with faces of the box

    def attempt(self, read: Callable[[], T]) -> T | None:
        """The result, or None after a mistake, which is kept."""
        try:
            return read()
        except CaseError as error:
            self.problems += error.problems
            return None

    def mistake(self, case: Case, keys: Keys, message: str) -> None:
        self.problems += case.error(keys, message).problems

    def note(self, case: Case, keys: Keys, mesh: Mesh) -> None:
        """Store the note on changes when the mesh of a body was read."""
        if mesh.note:
            self.notes.append(f"{case.place(*keys, 'mesh')}: {mesh.note}")


def check_meshes(case: Case) -> Findings:
    """All of it."""
    with reading_once():
        return _check(case)


def _check(case: Case) -> Findings:
    found = Findings()
    chosen = None if case.contact is None else case.contact.bodies
    if case.contact is not None:
        from fsci.builder.automatic_pairs import with_pairs

        case = found.attempt(partial(with_pairs, case)) or case
    if not found.problems:
        found.attempt(partial(require_known_pairs, case))
    found.pairs = {} if case.contact is None else case.contact.pairs
    _own_laws(case, found)
    _elastic(case, found)
    if case.contact is not None:
        for name, obstacle in case.contact.obstacles.items():
            if not isinstance(obstacle.mesh, FileMesh):
                continue
            mesh = found.attempt(partial(read_obstacle, case, name))
            if mesh is not None:
                found.note(case, ("contact", "obstacles", name), mesh)
    if case.fluid is not None:
        _rigid(case, found)
        if case.fluid.grid.refine and not found.problems:
            found.attempt(partial(read_grid, case))
        if not found.problems:
            found.attempt(partial(require_outlet, case))
    if not found.problems:
        _scene(case, found, chosen)
    return found


def _scene(case: Case, found: Findings, chosen: Literal["all"] | tuple[str, ...] | None) -> None:
    """Bodies in the wrong place, or that nothing holds; chosen: bodies whose pairs the program finds."""
    rigid = case.rigid_surfaces
    for name in case.elastic_bodies:
        if name not in found.meshes and (mesh := found.attempt(partial(read_body, case, name))) is not None:
            found.meshes[name] = mesh
    read = {name: found.attempt(partial(read_rigid_body, case, name)) for name in rigid}
    if found.problems:
        return
    bodies = []
    for name in case.elastic_bodies:
        keys: Keys = ("structure", "bodies", name)
        bodies.append(Placed(name, keys, True, True, found.meshes[name]))
        if (warning := free_motions(case, name, found.meshes[name])) is not None:
            found.warnings.append(f"{case.place(*keys)}: {warning}")
    for name, surface in rigid.items():
        mesh = read[name][0]  # type: ignore[index]
        bodies.append(Placed(name, surface.keys, name in (case.rigid or ()), False, mesh))
    said = [*pair_sizes(bodies, found.pairs), *around_box(case, bodies)]
    found.warnings += [f"{case.place(*keys)}: {text}" for keys, text in said]
    for only_note, keys, text in overlaps(case, bodies, found.pairs):
        (found.notes if only_note else found.warnings).append(f"{case.place(*keys)}: {text}")
    if case.fluid is not None:
        from fsci.check.impulsive import impulsive
        from fsci.check.resolution import coarse

        found.notes += list(impulsive(case))
        found.warnings += [f"{case.place(*keys)}: {text}" for keys, text in coarse(case, bodies, found.pairs)]
    if case.elastic_bodies:
        from fsci.builder.elements import choose_element
        from fsci.builder.roles import exchanged
        from fsci.builder.wall_pairs import wall_pairs
        from fsci.check.damped_modes import alternating
        from fsci.check.dry_facets import dry_facets
        from fsci.check.faceted_fits import faceted_fits
        from fsci.check.unpaired import unpaired

        for name in case.elastic_bodies:
            place, mesh = case.place("structure", "bodies", name, "mesh"), found.meshes[name]
            chosen_element = choose_element(case, name, mesh)
            found.notes += [f"{place}: {words}" for words in chosen_element.notes]
            found.warnings += [f"{place}: {words}" for words in chosen_element.warnings]
        for pair in wall_pairs(case, {name: found.meshes[name] for name in case.elastic_bodies}):
            found.walls.setdefault(pair.body, []).append(pair.name)

        names = list(case.elastic_bodies) if chosen in (None, "all") else chosen
        meshes = {name: found.meshes[name] for name in names}
        at = case.place("structure" if case.contact is None else "contact")
        found.notes += [f"{at}: {text}" for text in unpaired(case, meshes, found.pairs)]
        found.notes += list(alternating(case, found.meshes))
        found.warnings += [f"{case.place(*keys)}: {text}" for keys, text in dry_facets(case, bodies)]
        for name, why in exchanged(case, found.meshes, found.pairs).items():  # of none that the program finds
            found.notes.append(f"{case.place('contact', 'pairs', name)}: {why}")
        for name, text in faceted_fits(case, found.meshes, found.pairs):
            found.warnings.append(f"{case.place('contact', 'pairs', name)}: {text}")


def _own_laws(case: Case, found: Findings) -> None:
    """Laws in files of the user: mistakes of their code, and a stress without a strain."""
    for name, body in case.elastic_bodies.items():
        if not isinstance(body.material, OwnLawSection):
            continue
        from fsci.builder.own_law import own_law_at_rest

        mesh = found.attempt(partial(read_body, case, name))
        at_rest = mesh and found.attempt(partial(own_law_at_rest, case, name, mesh.points[mesh.cells].mean(axis=1).T))
        if at_rest and at_rest.stress > STRESS_OF_ROUNDING * (at_rest.mu + at_rest.bulk):
            place = case.place("structure", "bodies", name, "material", "law")
            words = f"a stress of {at_rest.stress:.4g} [stress] in the undeformed body '{name}'"
            found.warnings.append(case.worded(f"{place}: '{body.material.function}' gives {words}"))


def _elastic(case: Case, found: Findings) -> None:
    for name, body in case.elastic_bodies.items():
        wanted = ("structure", name, "at")
        at_points = [(key, p) for key, p in case.probes.items() if (p.field, p.body, p.place) == wanted]
        symmetric = [(i, support.on or ()) for i, support in enumerate(body.supports) if support.symmetry]
        at_nodes = [
            p for p in (*body.supports, *body.springs, *body.point_forces) if getattr(p, "at", None) is not None
        ]
        massless = case.structure is not None and case.structure.dynamics is not None and slave_surfaces(case, name)
        pairs = [] if case.contact is None else case.contact.pairs.values()
        moved = [pair for pair in pairs if pair.moves_nodes and name in {side.body for _, side in pair.sides}]
        edges = [pair for pair in pairs if pair.sides[0][1].body == name and len(pair.sides[0][1].on or ()) > 1]
        special = at_points or symmetric or at_nodes or massless or moved or edges
        needed = special or (case.coupling and _has_period(case))
        if not (needed or isinstance(body.mesh, FileMesh)):
            continue
        mesh = found.attempt(partial(read_body, case, name))
        if mesh is None:
            continue
        found.meshes[name] = mesh
        keys: Keys = ("structure", "bodies", name)
        found.note(case, keys, mesh)
        for key, probe in at_points:
            assert probe.at is not None
            if locate(mesh, np.array(probe.at, dtype=float)) is None:
                found.mistake(case, ("probes", key, "at"), f"the point {tuple(probe.at)} is not in body '{name}'")
        for i, surfaces in symmetric:
            if not all(_is_flat(mesh, surface) for surface in surfaces):
                found.mistake(
                    case,
                    (*keys, "supports", i),
                    "a plane of symmetry must be plane, but this surface is curved; take 'normal: true'",
                )
        if case.coupling is not None:
            _wet(case, found, keys, mesh)
    _one_dimension(case, found)
    if not found.problems:
        found.attempt(partial(_move_nodes, case, found))


def _move_nodes(case: Case, found: Findings) -> None:
    if case.contact is not None and any(pair.moves_nodes for pair in case.contact.pairs.values()):
        from fsci.builder.adjust import adjusted
        from fsci.builder.tied import join_tied

        before, after = found.meshes, adjusted(case, found.meshes)
        for name, mesh in after.items():
            if mesh is not before[name]:
                found.note(case, ("structure", "bodies", name), mesh)
        found.meshes = after
        join_tied(case, after)


def _is_flat(mesh: Mesh, surface: str) -> bool:
    x = mesh.points[np.unique(surface_facets(mesh, surface))]
    x = x - x.mean(axis=0)
    extents = np.ptp(x @ np.linalg.svd(x, full_matrices=True)[2].T, axis=0)
    return bool(extents[-1] <= 1e-9 * extents.max())


def _wet(case: Case, found: Findings, keys: Keys, mesh: Mesh) -> None:
    """Further checks of an elastic body in a flow."""
    name = str(keys[-1])
    skin = found.attempt(partial(find_skin, case, name, mesh))
    if skin is not None:
        found.attempt(partial(require_shorter_than_period, case, keys, skin[0].points))
    if isinstance(case.elastic_bodies[name].mesh, FileMesh):
        _against_grid(case, found, keys, mesh, moves=True)


def _one_dimension(case: Case, found: Findings) -> None:
    """All bodies are in 2D, or all in 3D."""
    dims = {name: mesh.points.shape[1] for name, mesh in found.meshes.items()}
    first = next(iter(dims.values()), None)
    for name, dim in dims.items():
        if dim != first:
            error = case.error(
                ("structure", "bodies", name, "mesh"), f"the mesh is {dim}D, but another body is {first}D"
            )
            found.problems += error.problems


def _rigid(case: Case, found: Findings) -> None:
    assert case.fluid is not None
    points = [(key, k, at) for key, p in case.probes.items() if p.field == "fluid" for k, at in _points(p)]
    surfaces, motions = [], []
    for name, body in case.fluid.bodies.items():
        turns = body.motion is not None and body.motion.rotation is not None
        if not (isinstance(body.mesh, FileMesh) or points or body.on or turns or _has_period(case)):
            continue
        read = found.attempt(partial(read_rigid_body, case, name))
        if read is None:
            continue
        mesh, x, facets = read
        keys: Keys = ("fluid", "bodies", name)
        found.note(case, keys, mesh)
        if body.motion is not None:
            if turns and case.fluid.scheme != "steady" and (warning := fast_body(case, case.fluid, body.motion, x)):
                found.warnings.append(f"{case.place(*keys, 'motion')}: {warning}")
            x = rigid_motion(x, body.motion, case.time.start, case.time.step)(case.time.start)[0]
        found.attempt(partial(require_shorter_than_period, case, keys, x))
        if isinstance(body.mesh, FileMesh):
            _against_grid(case, found, keys, mesh, moves=body.motion is not None)
        surfaces.append(ImmersedSurface(name, facets, len(x)))
        motions.append(Motion(x, np.zeros_like(x)))
    for key, setting, at in points:
        try:
            require_outside(np.array(at, dtype=float), surfaces, motions)
        except PointInBody as error:
            found.mistake(case, ("probes", key, setting), str(error))


def _points(probe: Any) -> Iterator[tuple[str, tuple[float, ...]]]:
    for key in ("at", "minus"):
        if getattr(probe, key) is not None:
            yield key, getattr(probe, key)


def _has_period(case: Case) -> bool:
    return case.fluid is not None and any(patch.periodic for patch in case.fluid.patches.values())


def _against_grid(case: Case, found: Findings, keys: Keys, mesh: Mesh, *, moves: bool) -> None:
    """Warnings about the size of a body in the flow."""
    assert case.fluid is not None
    if keys[-1] in (case.coupling.dry_side if case.coupling is not None else ()):
        return
    sizes = thickness(mesh), _length(mesh)
    if warning := thin_body(case, case.fluid, *sizes, moves=moves, hollow=is_hollow(mesh)):
        found.warnings.append(f"{case.place(*keys, 'mesh')}: {warning}")


def _length(mesh: Mesh) -> float:
    """Largest extent [m], in 3D the second one: of a plate the shorter of its edges."""
    if mesh.points.shape[1] == 2:
        return float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    axes = np.linalg.svd(mesh.points - mesh.points.mean(axis=0), full_matrices=False)[2]
    return float(np.sort(np.ptp(mesh.points @ axes.T, axis=0))[1])


def is_hollow(mesh: Mesh) -> bool:
    """Whether a closed part of the surface has the body outside."""
    facets, nodes = tessellate(mesh)
    part = components(nodes[facets], len(mesh.points))
    return any(enclosed(mesh.points, nodes[facets[part == number]]) < 0.0 for number in range(int(part.max()) + 1))


def thickness(mesh: Mesh) -> float:
    """The least extent of a body [m], of its principal axes or 2 d V / A: right for plates, discs, balls and boxes."""
    x = mesh.points - mesh.points.mean(axis=0)
    axes = np.linalg.svd(x, full_matrices=False)[2]
    facets, nodes = tessellate(mesh)
    corners = mesh.points[nodes][facets]
    edges = corners[:, 1:] - corners[:, :1]
    dim = x.shape[1]
    area = np.linalg.norm(edges[:, 0] if dim == 2 else 0.5 * np.cross(edges[:, 0], edges[:, 1]), axis=1).sum()
    return float(min(np.ptp(x @ axes.T, axis=0).min(), 2 * dim * signed_volumes(mesh).sum() / area))
