"""Distances of points to a surface, without a limit, for probes of the gap."""

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
        inside = _to_inside(points, simplex) if len(simplex) == 3 else np.full(len(points), np.inf)
        edges = [(a, b) for a in range(len(simplex)) for b in range(a)]
        to_edges = [_to_segment(points, simplex[a], simplex[b]) for a, b in edges]
        closest = np.minimum.reduce([closest, inside, *to_edges])
    return closest


def _to_segment(points: Array, a: Array, b: Array) -> Array:
    along = b - a
    size = float(along @ along)
    share = np.clip((points - a) @ along / size, 0.0, 1.0) if size > 0.0 else np.zeros(len(points))
    return np.linalg.norm(points - a - share[:, None] * along, axis=1)


def _to_inside(points: Array, corners: Array) -> Array:
    """Distance to the plane of a triangle for points whose projection is inside the triangle, else infinity."""
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    normal = np.cross(first, second)
    size = float(normal @ normal)
    if size == 0.0:
        return np.full(len(points), np.inf)
    away = points - corners[0]
    u = np.cross(away, second) @ normal / size
    v = np.cross(first, away) @ normal / size
    above = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    return np.where(above, np.abs(away @ normal) / np.sqrt(size), np.inf)
