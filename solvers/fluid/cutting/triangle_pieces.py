"""Pieces of surface in 3D that are triangles within facets, where surfaces touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.background.box import Grid
from solvers.fluid.cutting.pieces import Pieces
from solvers.gauss import gauss
from solvers.lagrange import lagrange


def parts_of_triangles(
    grid: Grid, number: int, row: int, parts: Array, facets: NDArray[np.int64], x: Array, points: Array
) -> Pieces:
    """Pieces in a cell of the box that are triangles.

    number: of the cell; row: among the cut cells; parts: (facet, corners) in reference coordinates of the cell, seen
    counterclockwise from outside of the fluid, shape (n, 10); facets: triangles with vertices at x [m]; points: of the
    quadrature in one direction.
    """
    facet, corners = parts[:, 0].astype(np.int64), parts[:, 1:].reshape(-1, 3, 3)
    index = np.unravel_index(number, grid.shape, order="F")
    low, high = (np.array([edge[i + side] for edge, i in zip(grid.edges, index, strict=True)]) for side in (0, 1))
    size = high - low
    nodes, weights = gauss((3 * len(points) + 1) // 2)
    s, t = np.meshgrid(nodes, nodes, indexing="ij")
    barycentric = np.stack([1.0 - s, s * (1.0 - t), s * t], axis=2).reshape(-1, 3)
    at = barycentric @ corners
    cross = np.cross((corners[:, 1] - corners[:, 0]) * size, (corners[:, 2] - corners[:, 0]) * size)
    twice = np.linalg.norm(cross, axis=1)
    weight = twice[:, None] * (np.multiply.outer(weights, weights) * s).ravel()
    vertex = _barycentric((x[facets[facet]] - low) / size, at, size)
    L = np.einsum("pga,pgb,pgc->pgcba", *(lagrange(points, at[..., axis]) for axis in range(3)), optimize=True)
    L = L.reshape(len(facet), len(barycentric), len(points) ** 3)
    moments = np.einsum("pgq,pgv,pg->pqv", L, vertex, weight, optimize=True)
    mass = np.einsum("pgv,pgw,pg->pvw", vertex, vertex, weight, optimize=True)
    return Pieces(np.full(len(facet), row), facet, moments, mass, cross / twice[:, None])


def _barycentric(corners: Array, at: Array, size: Array) -> Array:
    """Barycentric coordinates in triangles (p, 3, 3) of the points nearest to some others (p, g, 3) in their planes."""
    first, second = (corners[:, 1] - corners[:, 0]) * size, (corners[:, 2] - corners[:, 0]) * size
    way = (at - corners[:, None, 0]) * size
    matrix = np.stack([first, second], axis=1)
    gram = matrix @ np.swapaxes(matrix, 1, 2)
    found = np.linalg.solve(gram[:, None], (way @ np.swapaxes(matrix, 1, 2))[..., None])[..., 0]
    return np.concatenate([1.0 - found.sum(axis=2, keepdims=True), found], axis=2)
