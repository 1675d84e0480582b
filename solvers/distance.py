"""Distances of points to a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.cell_types import CELL_TYPES


def distances(points: Array, x: Array, facets: NDArray[np.int64], facet_type: str) -> Array:
    """Distances [m] of points (n, dim) to facets with nodes at x [m]; facets are divided into flat simplices."""
    simplices = np.array(CELL_TYPES[facet_type].simplices)
    corners = x[facets[:, simplices].reshape(-1, simplices.shape[1])]
    closest = np.full(len(points), np.inf)
    for simplex in corners:
        closest = np.minimum(
            closest, distances_in_pairs(points, np.broadcast_to(simplex, (len(points), *simplex.shape)))
        )
    return closest


def distances_in_pairs(points: Array, corners: Array) -> Array:
    """Distance [m] of each point, (n, dim), to a segment or triangle of its own with corners (n, dim, dim)."""
    dim = points.shape[1]
    found = np.minimum.reduce([_to_segment(points, corners[:, a], corners[:, b]) for a in range(dim) for b in range(a)])
    return np.minimum(found, _to_inside(points, corners)) if dim == 3 else found


def _to_segment(points: Array, a: Array, b: Array) -> Array:
    along, away = b - a, points - a
    size = np.einsum("nd,nd->n", along, along)
    share = np.divide(np.einsum("nd,nd->n", away, along), size, out=np.zeros_like(size), where=size > 0.0)
    return np.linalg.norm(away - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1)


def _to_inside(points: Array, corners: Array) -> Array:
    """Distance to the plane of a triangle for points whose projection is inside the triangle, else infinity."""
    first, second, away = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    normal = np.cross(first, second)
    size = np.einsum("nd,nd->n", normal, normal)
    u = np.einsum("nd,nd->n", np.cross(away, second), normal)
    v = np.einsum("nd,nd->n", np.cross(first, away), normal)
    above = (size > 0.0) & (u >= 0.0) & (v >= 0.0) & (u + v <= size)
    height = np.abs(np.einsum("nd,nd->n", away, normal))
    return np.divide(height, np.sqrt(size), out=np.full(len(points), np.inf), where=above)
