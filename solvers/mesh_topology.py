"""Which nodes make the facets of a cell, and which facets make the boundary of a mesh: tables and pure numpy.

Cells and facets follow VTK's node order, second-order nodes included. Facets are oriented outward: in 3D
their nodes run counterclockwise seen from outside; in 2D the body lies on the left of the way from the first
node to the second, so that the outward normal of an edge (dx, dy) is (dy, -dx).
"""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial

import numpy as np
from numpy.typing import NDArray

from solvers.mesh import Mesh

Indices = NDArray[np.int64]
Group = tuple[int, ...]


def _corners(count: int) -> tuple[Group, ...]:
    return tuple((corner,) for corner in range(count))


#: Every node of a cell as the corners whose middle it is, in VTK's order: (2,) a corner, (0, 1) a mid node.
NODES: dict[str, tuple[Group, ...]] = {
    "line": _corners(2),
    "line3": (*_corners(2), (0, 1)),
    "triangle": _corners(3),
    "triangle6": (*_corners(3), (0, 1), (1, 2), (2, 0)),
    "quad": _corners(4),
    "quad9": (*_corners(4), (0, 1), (1, 2), (2, 3), (3, 0), (0, 1, 2, 3)),
    "tetra": _corners(4),
    "tetra10": (*_corners(4), (0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "hexahedron": _corners(8),
    "hexahedron27": (
        *_corners(8),
        *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
        *((0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)),
        (0, 1, 2, 3, 4, 5, 6, 7),
    ),
}

#: Cell type of the same shape and first order: the cell of the corners.
FIRST_ORDER = {
    "line": "line",
    "line3": "line",
    "triangle": "triangle",
    "triangle6": "triangle",
    "quad": "quad",
    "quad9": "quad",
    "tetra": "tetra",
    "tetra10": "tetra",
    "hexahedron": "hexahedron",
    "hexahedron27": "hexahedron",
}

#: Number of corners.
CORNERS = {cell_type: len(NODES[first]) for cell_type, first in FIRST_ORDER.items()}

#: Type of the facets.
FACET_TYPE = {
    "triangle": "line",
    "triangle6": "line3",
    "quad": "line",
    "quad9": "line3",
    "tetra": "triangle",
    "tetra10": "triangle6",
    "hexahedron": "quad",
    "hexahedron27": "quad9",
}

_CORNER_POSITIONS: dict[str, tuple[tuple[float, ...], ...]] = {
    "line": ((0,), (1,)),
    "triangle": ((0, 0), (1, 0), (0, 1)),
    "quad": ((0, 0), (1, 0), (1, 1), (0, 1)),
    "tetra": ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "hexahedron": (
        *((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)),
        *((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
    ),
}

_CORNER_FACETS: dict[str, tuple[Group, ...]] = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    "hexahedron": (
        *((0, 3, 2, 1), (4, 5, 6, 7)),
        *((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    ),
}

_CORNER_MIRROR: dict[str, Group] = {
    "triangle": (0, 2, 1),
    "quad": (0, 3, 2, 1),
    "tetra": (0, 2, 1, 3),
    "hexahedron": (0, 3, 2, 1, 4, 7, 6, 5),
}


def _follow(cell_type: str, part_type: str, corners: Group) -> Group:
    """Local nodes of that part (facet, mirrored cell) of a cell which has these corners."""
    position = {frozenset(group): node for node, group in enumerate(NODES[cell_type])}
    return tuple(position[frozenset(corners[i] for i in group)] for group in NODES[part_type])


#: Local nodes of every facet of a cell, outward oriented, in the order of the facet's type.
FACETS: dict[str, tuple[Group, ...]] = {
    cell_type: tuple(_follow(cell_type, facet_type, facet) for facet in _CORNER_FACETS[FIRST_ORDER[cell_type]])
    for cell_type, facet_type in FACET_TYPE.items()
}

#: Local nodes of the cell turned inside out: makes a cell of negative volume positive.
MIRROR: dict[str, Group] = {
    cell_type: _follow(cell_type, cell_type, _CORNER_MIRROR[FIRST_ORDER[cell_type]]) for cell_type in FACET_TYPE
}


def reference_nodes(cell_type: str) -> NDArray[np.float64]:
    """Positions of the nodes in the unit cell (edges from 0 to 1), shape (nodes, dim)."""
    corners = np.array(_CORNER_POSITIONS[FIRST_ORDER[cell_type]], dtype=float)
    return np.array([corners[list(group)].mean(axis=0) for group in NODES[cell_type]])


def signed_volumes(mesh: Mesh) -> NDArray[np.float64]:
    """Volumes (2D: areas) of the cells with straight edges, negative if inside out, shape (cells,)."""
    first = FIRST_ORDER[mesh.cell_type]
    corners = mesh.points[mesh.cells[:, : CORNERS[first]]]
    corners = corners - corners[:, :1]
    # the cell is the sum of the simplices between its first corner and its facets
    simplices = [list(simplex) for facet in _CORNER_FACETS[first] for simplex in _simplices(facet)]
    determinants = sum(np.linalg.det(corners[:, simplex]) for simplex in simplices)
    return np.asarray(determinants / factorial(mesh.points.shape[1]))


def cell_facets(mesh: Mesh) -> Indices:
    """All facets, cell by cell, outward oriented, shape (cells * facets per cell, nodes per facet)."""
    facets = np.array(FACETS[mesh.cell_type])
    return mesh.cells[:, facets].reshape(-1, facets.shape[1])


def boundary_facets(mesh: Mesh) -> Indices:
    """The facets of one cell only, with all their nodes, outward oriented, shape (k, nodes per facet)."""
    facets = cell_facets(mesh)
    ids = _row_ids(_sorted_corners(mesh, facets))
    return facets[np.bincount(ids)[ids] == 1]


def find_facets(mesh: Mesh, corners: Indices) -> Indices:
    """The facets with these corners, given in any order; those that no cell has are left out.

    All their nodes, outward oriented as of the first cell that has them, shape (k or less, nodes per facet).
    """
    return _pick(mesh, cell_facets(mesh), corners)


def surface_facets(mesh: Mesh, name: str) -> Indices:
    """The facets of a named surface with all their nodes, outward oriented, shape (k, nodes per facet).

    Raises KeyError if there is no such surface, ValueError if it is not part of the boundary.
    """
    corners = mesh.surfaces[name]
    facets = _pick(mesh, boundary_facets(mesh), corners)
    if len(facets) < len(corners):
        inside = len(corners) - len(facets)
        raise ValueError(f"surface '{name}': {inside} of its facets are not on the boundary of the mesh")
    return facets


def cut_out(mesh: Mesh, names: Sequence[str] | None) -> tuple[NDArray[np.float64], Indices, Indices]:
    """Named surfaces as one: (points, facets, node numbers in the mesh); a facet that is in several counts once.

    None: the whole boundary. Raises KeyError and ValueError as `surface_facets`.
    """
    parts = [boundary_facets(mesh)] if names is None else [surface_facets(mesh, name) for name in names]
    facets = np.concatenate(parts)
    facets = facets[np.sort(np.unique(facets, axis=0, return_index=True)[1])]
    nodes, local = np.unique(facets, return_inverse=True)
    return mesh.points[nodes], local.reshape(facets.shape).astype(np.int64), nodes


def _pick(mesh: Mesh, facets: Indices, corners: Indices) -> Indices:
    ids = _row_ids(np.concatenate([_sorted_corners(mesh, facets), np.sort(corners, axis=1)]))
    first = np.full(ids.max(initial=-1) + 1, -1)
    first[ids[: len(facets)][::-1]] = np.arange(len(facets))[::-1]
    rows = first[ids[len(facets) :]]
    return facets[rows[rows >= 0]]


def _simplices(facet: Group) -> list[Group]:
    if len(facet) == 2:
        return [facet]
    return [(facet[0], facet[i], facet[i + 1]) for i in range(1, len(facet) - 1)]


def _sorted_corners(mesh: Mesh, facets: Indices) -> Indices:
    return np.sort(facets[:, : CORNERS[FACET_TYPE[mesh.cell_type]]], axis=1)


def _row_ids(rows: Indices) -> Indices:
    """A number for every row, equal where rows are equal, shape (rows,)."""
    ids = rows[:, 0]
    for column in rows.T[1:]:
        # two columns at a time: a product of two counts never leaves 64 bits, a product of four would
        column = column - column.min(initial=0)
        ids = np.unique(ids * (column.max(initial=0) + 1) + column, return_inverse=True)[1]
    return ids
