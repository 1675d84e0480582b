"""The facets of a mesh: all, those of its boundary, and those of its named surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from solvers.api import Indices
from solvers.mesh.cell_types import CELL_TYPES, Group
from solvers.mesh.mesh import Mesh

_boundaries: WeakKeyDictionary[Mesh, Indices] = WeakKeyDictionary()  # a search for them sorts all facets


def signed_volumes(mesh: Mesh) -> NDArray[np.float64]:
    """Volumes (2D: areas) of the cells with straight edges, negative if inside out, shape (cells,)."""
    shape = CELL_TYPES[mesh.cell_type].shape
    corners = mesh.points[mesh.cells[:, : len(shape.corners)]]
    corners = corners - corners[:, :1]
    # the cell is the sum of the simplices between its first corner and its facets
    simplices = [list(simplex) for facet in shape.facets for simplex in _simplices(facet)]
    determinants = sum(determinant(corners[:, simplex]) for simplex in simplices)
    return np.asarray(determinants / factorial(mesh.points.shape[1]))


def determinant(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Determinants of matrices (..., dim, dim), 2 or 3 wide: faster than LAPACK's."""
    m = np.moveaxis(matrices, (-2, -1), (0, 1))
    if len(m) == 2:
        return np.asarray(m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0])
    minors = [m[1, i] * m[2, j] - m[1, j] * m[2, i] for i, j in ((1, 2), (2, 0), (0, 1))]
    return np.asarray(m[0, 0] * minors[0] + m[0, 1] * minors[1] + m[0, 2] * minors[2])


def cell_facets(mesh: Mesh) -> Indices:
    """All facets, cell by cell, outward oriented, shape (cells * facets per cell, nodes per facet)."""
    facets = np.array(CELL_TYPES[mesh.cell_type].facets)
    return mesh.cells[:, facets].reshape(-1, facets.shape[1])


def boundary_facets(mesh: Mesh) -> Indices:
    """The facets of one cell only, with all their nodes, outward oriented, shape (k, nodes per facet)."""
    return cell_facets(mesh)[boundary_rows(mesh)]


def boundary_rows(mesh: Mesh) -> Indices:
    """Indices among `cell_facets` of the facets of one cell only, increasing."""
    if mesh not in _boundaries:
        facet_ids(mesh)
    return _boundaries[mesh]


def facet_ids(mesh: Mesh) -> Indices:
    """A number for every facet of `cell_facets`, equal where corners are the same, shape (cells * facets per cell,)."""
    ids = _row_ids(_sorted_corners(mesh, cell_facets(mesh)))
    _boundaries[mesh] = np.flatnonzero(np.bincount(ids)[ids] == 1)
    return ids


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
    named = np.zeros(len(mesh.points), dtype=bool)
    named[corners] = True
    facets = facets[named[facets[:, : corners.shape[1]]].all(axis=1)]
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
    return np.sort(facets[:, : CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].corners], axis=1)


def _row_ids(rows: Indices) -> Indices:
    """A number for every row of numbers from 0 on, equal where rows are equal, shape (rows,)."""
    ids, size = rows[:, 0], int(rows[:, 0].max(initial=0)) + 1
    for column in rows.T[1:]:
        count = int(column.max(initial=0)) + 1
        if size * count > 2**62:  # smaller numbers for the columns so far: products stay within 64 bits
            ids = np.unique(ids, return_inverse=True)[1]
            size = int(ids.max(initial=0)) + 1
        ids, size = ids * count + column, size * count
    return np.unique(ids, return_inverse=True)[1]
