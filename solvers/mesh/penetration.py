"""How deep points lie in a body, by its closed surface of segments or triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.mesh.distance import distances_in_pairs
from solvers.mesh.search import Search


def inside(points: Array, corners: Array) -> NDArray[np.bool_]:
    """Which points (n, dim) are in the solid that facets enclose, with corners (m, dim, dim), positions in [m]."""
    return windings(points, corners) > 0.5


def windings(points: Array, corners: Array) -> Array:
    """How often facets with corners (m, dim, dim) enclose points (n, dim): 2 where a solid overlaps itself, shape (n,).

    A ray along x from the point crosses the surface an odd number of times, counted with the direction of each facet.
    A facet has the lower ends of its edges and not the upper ones, so that each point of the surface is in one facet.
    """
    (count, dim), size = points.shape, len(corners)
    if not count or not size:
        return np.zeros(count)
    ends = points.copy()
    ends[:, 0] = np.maximum(points[:, 0], corners[:, :, 0].max())
    rays = np.arange(count)[:, None] + count * np.array([0, 1, 1][:dim])
    search = Search(rays, np.arange(size * dim).reshape(size, dim))
    ray, facet = search.pairs(np.concatenate([points, ends]), corners.reshape(-1, dim), 0.0).T
    return np.asarray(np.bincount(ray, _crossings(points[ray], corners[facet]), count), dtype=float)


def _crossings(x: Array, corners: Array) -> Array:
    """1 where a ray along x from a point leaves the solid through its facet, -1 where it enters, else 0; shape (k,)."""
    if x.shape[1] == 2:
        a, b = corners[:, 0], corners[:, 1]
        up = (a[:, 1] <= x[:, 1]) & (b[:, 1] > x[:, 1])
        down = (b[:, 1] <= x[:, 1]) & (a[:, 1] > x[:, 1])
        beyond = _at_height(a, b, x[:, 1], 1, 0) > x[:, 0]
        return np.where(beyond, up.astype(float) - down, 0.0)
    turns = np.zeros(len(x))
    for k in range(3):
        a, b = corners[:, k], corners[:, (k + 1) % 3]
        up = (a[:, 1] <= x[:, 1]) & (b[:, 1] > x[:, 1])
        down = (b[:, 1] <= x[:, 1]) & (a[:, 1] > x[:, 1])
        turns += np.where(_at_height(a, b, x[:, 1], 1, 2) > x[:, 2], up.astype(float) - down, 0.0)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    hit = (turns != 0.0) & (normal[:, 0] != 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        away = np.einsum("kd,kd->k", corners[:, 0] - x, normal) / normal[:, 0]
    return np.where(hit & (away > 0.0), np.sign(normal[:, 0]), 0.0)


def _at_height(a: Array, b: Array, height: Array, along: int, wanted: int) -> Array:
    """Coordinate `wanted` of the lines through a and b where `along` has given values; the same for (b, a)."""
    swap = (a[:, along] > b[:, along])[:, None]
    low, high = np.where(swap, b, a), np.where(swap, a, b)
    rise = high[:, along] - low[:, along]
    share = np.divide(height - low[:, along], rise, out=np.zeros_like(rise), where=rise > 0.0)
    return low[:, wanted] + share * (high[:, wanted] - low[:, wanted])


def depths(points: Array, corners: Array, tolerance: Array) -> Array:
    """Depth [m] below the surface of points (n, dim) in the solid; zero for those within their tolerance (n,) of it."""
    found = _distances(points, corners, tolerance)
    deep = np.flatnonzero(found > tolerance)
    found[found <= tolerance] = 0.0
    if len(deep):
        flat = corners.reshape(-1, corners.shape[2])
        nearest = np.array([np.linalg.norm(flat - point, axis=1).min() for point in points[deep]])
        found[deep] = _distances(points[deep], corners, nearest)
    return found


def _distances(points: Array, corners: Array, reach: Array) -> Array:
    """Distances [m] of points to the nearest facet that is not farther than their reach [m]; infinite without one."""
    found = np.full(len(points), np.inf)
    if not len(points):
        return found
    size, dim = corners.shape[:2]
    search = Search(np.repeat(np.arange(len(points))[:, None], dim, axis=1), np.arange(size * dim).reshape(size, dim))
    point, facet = search.pairs(points, corners.reshape(-1, dim), reach).T
    np.minimum.at(found, point, distances_in_pairs(points[point], corners[facet]))
    return found
