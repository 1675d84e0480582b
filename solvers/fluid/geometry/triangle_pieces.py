"""Pieces of surface in 3D that are triangles within facets, where surfaces touch; all at once."""

from __future__ import annotations

import numpy as np

from solvers.api import Array, Indices
from solvers.fluid.geometry.pieces import Pieces, place_of
from solvers.fluid.grid.box import Grid
from solvers.mesh.gauss import gauss
from solvers.mesh.lagrange import lagrange

#: Triangles whose integrals are computed together, to bound the memory.
TRIANGLES_AT_ONCE = 512


def parts_of_triangles(
    grid: Grid, cell: Indices, row: Indices, parts: Array, facets: Indices, x: Array, points: Array
) -> Pieces:
    """Pieces in cells of the box that are triangles.

    cell: number in the box of that of each triangle; row: among the cut cells; parts: (facet, corners) in reference
    coordinates of the cell, seen counterclockwise from outside of the fluid, shape (n, 10); facets: triangles with
    vertices at x [m]; points: of the quadrature in one direction.
    """
    facet, corners = parts[:, 0].astype(np.int64), parts[:, 1:].reshape(-1, 3, 3)
    low, size = place_of(grid, cell)
    first, second = (corners[:, k] - corners[:, 0] for k in (1, 2))
    cross = np.cross(first * size, second * size)
    twice = np.linalg.norm(cross, axis=1)
    at_facet = (x[facets[facet]] - low[:, None]) / size[:, None]
    moments, mass = np.empty((len(parts), len(points) ** 3, 3)), np.empty((len(parts), 3, 3))
    for start in range(0, len(parts), TRIANGLES_AT_ONCE):
        some = slice(start, start + TRIANGLES_AT_ONCE)
        moments[some], mass[some] = _integrals(corners[some], twice[some], at_facet[some], size[some], points)
    return Pieces(row, facet, moments, mass, cross / twice[:, None])


def _integrals(corners: Array, twice: Array, facets: Array, size: Array, points: Array) -> tuple[Array, Array]:
    """(int L_q lambda_v, int lambda_v lambda_w) over triangles with these corners and twice these areas.

    lambda: barycentric coordinates in the triangles `facets`; both in reference coordinates of cells with edges `size`.
    """
    nodes, weights = gauss((3 * len(points) + 1) // 2)
    s, t = np.meshgrid(nodes, nodes, indexing="ij")
    barycentric = np.stack([1.0 - s, s * (1.0 - t), s * t], axis=2).reshape(-1, 3)
    at = barycentric @ corners
    weight = twice[:, None] * (np.multiply.outer(weights, weights) * s).ravel()
    vertex = _barycentric(facets, at, size)
    weighted = weight[:, :, None] * vertex
    a, b, c = (lagrange(points, at[..., axis]) for axis in range(3))
    L = (c[..., :, None, None] * b[..., None, :, None] * a[..., None, None, :]).reshape(*at.shape[:2], -1)
    return np.swapaxes(L, 1, 2) @ weighted, np.swapaxes(vertex, 1, 2) @ weighted


def _barycentric(corners: Array, at: Array, size: Array) -> Array:
    """Barycentric coordinates in triangles (p, 3, 3) of the points nearest to some others (p, g, 3) in their planes."""
    matrix = (corners[:, 1:] - corners[:, :1]) * size[:, None]
    way = (at - corners[:, :1]) * size[:, None]
    gram = matrix @ np.swapaxes(matrix, 1, 2)
    found = np.swapaxes(np.linalg.solve(gram, matrix @ np.swapaxes(way, 1, 2)), 1, 2)
    return np.concatenate([1.0 - found.sum(axis=2, keepdims=True), found], axis=2)
