"""How deep points lie in a body, by its closed surface of segments or triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.distance import distances

#: Points and facets that are compared at once.
CHUNK = 4_000_000


def inside(points: Array, corners: Array) -> NDArray[np.bool_]:
    """Which points, shape (n, dim), are in the solid that facets enclose, with corners (m, dim, dim), positions in [m].

    A ray along an axis from the point crosses the surface an odd number of times, counted with the direction of each
    facet. A facet has the lower ends of its edges and not the upper ones, so that each point is in one facet.
    """
    found = np.zeros(len(points), dtype=bool)
    if not len(points) or not len(corners):
        return found
    axis, met = _fewest(points, corners)
    points, corners = np.roll(points, -axis, axis=1), np.roll(corners[met], -axis, axis=2)
    if axis == 1 and points.shape[1] == 2:
        corners = corners[:, ::-1]  # x and y are exchanged, a reflection
    low, high = corners.min(axis=1), corners.max(axis=1)
    for part in np.array_split(np.arange(len(points)), 1 + len(points) * len(corners) // CHUNK):
        x = points[part]
        near = (high[:, 0] > x[:, :1]) & (low[:, 1] <= x[:, 1:2]) & (high[:, 1] > x[:, 1:2])
        if points.shape[1] == 3:
            near &= (low[:, 2] <= x[:, 2:]) & (high[:, 2] >= x[:, 2:])
        point, facet = np.nonzero(near)
        found[part] = np.bincount(point, _crossings(x[point], corners[facet]), len(part)) > 0.5
    return found


def _fewest(points: Array, corners: Array) -> tuple[int, NDArray[np.bool_]]:
    """The axis along which rays from all points meet the boxes of the fewest facets, and the mask of these."""
    low, high = points.min(axis=0), points.max(axis=0)
    above, below = corners.max(axis=1) >= low, corners.min(axis=1) <= high
    masks = []
    for axis in range(len(low)):
        others = [other for other in range(len(low)) if other != axis]
        masks.append(above.all(axis=1) & below[:, others].all(axis=1))
    axis = int(np.argmin([mask.sum() for mask in masks]))
    return axis, masks[axis]


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
    found = np.zeros(len(points))
    if not len(points):
        return found
    widest = float(tolerance.max())
    low, high = points.min(axis=0) - widest, points.max(axis=0) + widest
    near = ((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1)
    deep = _distances(points, corners[near]) > tolerance
    if deep.any():
        found[deep] = _distances(points[deep], corners)
    return found


def _distances(points: Array, corners: Array) -> Array:
    """Distances [m] of points to the nearest facet; infinite without one."""
    if not len(corners):
        return np.full(len(points), np.inf)
    count, dim = corners.shape[:2]
    numbers = np.arange(count * dim).reshape(count, dim)
    return distances(points, corners.reshape(-1, dim), numbers, "line" if dim == 2 else "triangle")
