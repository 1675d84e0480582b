"""The mesh of a body in a case: from a built-in shape or a file, transformed, with its named parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci import shapes
from fsci.meshes.files import MeshError, read_mesh, unknown
from fsci.rotation import rotation_matrix
from solvers.cell_types import CELL_TYPES
from solvers.mesh import Mesh
from solvers.mesh_topology import find_facets


def build_mesh(settings: Any, folder: Path) -> Mesh:
    """The mesh of a case's `mesh:` section; file names count from `folder`. Raises MeshError."""
    if getattr(settings, "shape", None) is not None:
        mesh = _shape(settings)
    else:
        order, parameters = getattr(settings, "order", None), getattr(settings, "parameters", None)
        mesh = read_mesh(folder / settings.file, order, parameters)
    return place(mesh, getattr(settings, "rotate", None), getattr(settings, "translate", None))


def _shape(settings: Any) -> Mesh:
    function = getattr(shapes, settings.shape)
    given = {name: getattr(settings, name, None) for name in signature(function).parameters}
    try:
        return function(**{name: value for name, value in given.items() if value is not None})
    except ValueError as error:
        raise MeshError(f"{settings.shape}: {error}") from None


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
