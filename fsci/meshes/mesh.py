"""The mesh of a body in a case: from a built-in shape or a file, transformed, with its named parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.meshes.files import MeshError, read_mesh, unknown
from fsci.meshes.named import with_surfaces
from fsci.meshes.refine import refined
from fsci.meshes.thickened import Sheet
from fsci.rotation import rotation_matrix
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import find_facets

MOST_CELLS = 10**8  #: of a refined mesh


def build_mesh(settings: Any, folder: Path, *, rigid: bool = False) -> Mesh:
    """The mesh of a case's `mesh:` section; file names count from `folder`. Raises MeshError.

    rigid: of a file a closed surface is enough.
    """
    if getattr(settings, "shape", None) is not None:
        mesh = settings.plan.mesh()
    else:
        order, parameters = getattr(settings, "order", None), getattr(settings, "parameters", None)
        order = 1 if order == "auto" else order
        size_factor, scale = getattr(settings, "size_factor", 1.0), getattr(settings, "scale", 1.0)
        sheet = None
        if (thickness := getattr(settings, "thickness", None)) is not None:
            sheet, order = Sheet(thickness / scale, settings.layers, order or 1), 1
        mesh = read_mesh(folder / settings.file, order, parameters, size_factor, rigid=rigid, sheet=sheet)
        mesh = replace(mesh, points=mesh.points * scale)
    mesh = with_surfaces(mesh, getattr(settings, "surfaces", {}))
    if getattr(settings, "refine", 0):
        mesh = _refined(mesh, settings.refine)
    if getattr(settings, "mirror", None) is not None:
        mesh = mirrored(mesh, "xyz".index(settings.mirror))
    return place(mesh, getattr(settings, "rotate", None), getattr(settings, "translate", None))


def _refined(mesh: Mesh, times: int) -> Mesh:
    cells = len(mesh.cells) * 2.0 ** min(mesh.points.shape[1] * times, 100)
    if times and cells > MOST_CELLS:
        raise MeshError(f"'refine: {times}' would make {cells:.2g} cells: {MOST_CELLS:.0e} are the most")
    for _ in range(times):
        mesh = refined(mesh)
    return mesh


def mirrored(mesh: Mesh, axis: int) -> Mesh:
    """Mirrored at the plane where the coordinate is zero; cells are numbered so that their volumes stay positive."""
    if axis >= mesh.points.shape[1]:
        raise MeshError("'mirror: z' is for meshes of three dimensions")
    points = mesh.points * np.where(np.arange(mesh.points.shape[1]) == axis, -1.0, 1.0)
    return replace(mesh, points=points, cells=mesh.cells[:, CELL_TYPES[mesh.cell_type].mirror])


def place(mesh: Mesh, rotate: Any = None, translate: Sequence[float] | None = None) -> Mesh:
    """Rotate about the origin, then translate [m].

    `rotate` is one rotation or a list of them, each with attributes `axis` and `angle` [degrees].
    """
    if not rotate and translate is None:
        return mesh
    points = mesh.points
    dim = points.shape[1]
    for rotation in rotate if isinstance(rotate, list | tuple) else [rotate] if rotate else []:
        try:
            points = points @ rotation_matrix(getattr(rotation, "axis", None), rotation.angle, dim).T
        except ValueError as error:
            raise MeshError(str(error)) from None
    if translate is not None:
        if len(translate) != dim:
            raise MeshError(f"translate has {len(translate)} numbers, the mesh has {dim} dimensions")
        points = points + np.asarray(translate, dtype=float)
    return replace(mesh, points=points)


def require_surface(mesh: Mesh, name: str) -> NDArray[np.int64]:
    """Corner nodes of a named surface, shape (facets, corners); a MeshError lists the names there are."""
    if name not in mesh.surfaces:
        raise unknown("surface", name, mesh.surfaces)
    return mesh.surfaces[name]


def require_region(mesh: Mesh, name: str) -> NDArray[np.int64]:
    """Indices of the cells of a named region; a MeshError lists the names there are."""
    if name not in mesh.regions:
        raise unknown("region", name, mesh.regions)
    return mesh.regions[name]


def extract_region(mesh: Mesh, name: str) -> Mesh:
    """The cells of a region as a mesh of its own, with its share of the surfaces and of other regions."""
    chosen = require_region(mesh, name)
    used, cells = np.unique(mesh.cells[chosen], return_inverse=True)
    numbers = chosen + 1 if mesh.numbers is None else mesh.numbers[chosen]
    part = Mesh(mesh.points[used], cells.reshape(len(chosen), -1), mesh.cell_type, numbers=numbers, note=mesh.note)

    index = np.full(len(mesh.points), -1)
    index[used] = np.arange(len(used))
    corners = CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].corners
    surfaces = {key: find_facets(part, index[facets])[:, :corners] for key, facets in mesh.surfaces.items()}
    regions = {key: np.flatnonzero(np.isin(chosen, of)) for key, of in mesh.regions.items()}
    lines = {key: index[of][(index[of] >= 0).all(axis=1)] for key, of in mesh.lines.items()}
    nodes = {key: index[of][index[of] >= 0] for key, of in mesh.nodes.items()}
    return replace(
        part,
        lines={key: of for key, of in lines.items() if len(of)},
        nodes={key: of for key, of in nodes.items() if len(of)},
        surfaces={key: facets for key, facets in surfaces.items() if len(facets)},
        regions={key: of for key, of in regions.items() if len(of)},
    )
