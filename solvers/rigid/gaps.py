"""Gaps of points to rigid surfaces of segments or triangles, and to walls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array

#: Distance relative to the extent of a surface from which on its direction is no rounding error.
RESOLVED = 1e-9


@dataclass(frozen=True)
class Gaps:
    """Gaps of points to a surface."""

    gap: Array  #: [m], negative behind the surface, shape (n,)
    normal: Array  #: unit vectors in which the gaps grow, shape (n, dim)
    facet: NDArray[np.int64]  #: the nearest facet, at an edge that which looks most towards the point; 0 of a wall


@dataclass(frozen=True)
class RigidWall:
    """A plane, or the part of it within a region, which bodies do not pass."""

    name: str
    at: Array  #: a point of it [m], shape (dim,)
    normal: Array  #: unit vector towards the bodies, shape (dim,)
    within: Callable[[Array], NDArray[np.bool_]] | None = None  #: of points (dim, n) of the plane; None: all of it

    def gaps(self, x: Array) -> Gaps:
        """Gaps of points (n, dim) [m], infinite beside the wall."""
        gap = (x - self.at) @ self.normal
        if self.within is not None:
            gap = np.where(self.within((x - gap[:, None] * self.normal).T), gap, np.inf)
        return Gaps(gap, np.broadcast_to(self.normal, x.shape), np.zeros(len(x), dtype=np.int64))


def gaps(x: Array, corners: Array, outward: Array | None = None, within: float = np.inf) -> Gaps:
    """Gaps of points (n, dim) to flat facets with corners (m, dim, dim), right-hand normals outwards, all in [m].

    They are the distances from the nearest facets, infinite from `within` on. Beside an edge or corner they grow away
    from it; what lies on it has the mean of the normals of its facets.
    outward: directions out of the body whose vertices the points are, (n, dim). A vertex that has entered the surface
    came through a facet that faces it, though it may be nearer to another one, at the side.
    """
    point, facet = _candidates(x, corners, within)
    normals, rounding = unit_normals(corners), RESOLVED * _extent(corners)
    found = Gaps(np.full(len(x), np.inf), np.zeros_like(x), np.zeros(len(x), dtype=np.int64))
    _set_nearest(found, x, corners, normals, (point, facet), within, rounding)
    if outward is None:
        return found
    entered = found.gap[point] <= rounding
    point, facet = point[entered], facet[entered]
    facing = np.einsum("pd,pd->p", outward[point], normals[facet]) < 0.0
    _set_nearest(found, x, corners, normals, (point[facing], facet[facing]), within, rounding)
    return found


def _set_nearest(
    found: Gaps,
    x: Array,
    corners: Array,
    normals: Array,
    pairs: tuple[NDArray[np.int64], NDArray[np.int64]],
    within: float,
    rounding: float,
) -> None:
    """Set the gaps of points that are nearer than `within` to facets of their pairs, which are ordered by points."""
    point, facet = pairs
    if len(point) == 0:
        return
    middles = corners.mean(axis=1)
    radii = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1) + rounding
    far = np.linalg.norm(x[point] - middles[facet], axis=1)
    new = np.diff(point, prepend=-1) > 0
    # a facet is no nearer than its middle less its radius, and the nearest one no farther than the nearest middle
    kept = far - radii[facet] <= np.minimum.reduceat(far, np.flatnonzero(new))[np.cumsum(new) - 1]
    point, facet = point[kept], facet[kept]
    away = x[point] - feet(x[point], corners[facet])
    distances = np.linalg.norm(away, axis=1)
    near = distances < within
    _nearest(found, (point[near], facet[near]), away[near], distances[near], normals, rounding)


def _candidates(x: Array, corners: Array, within: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(points, facets) of all pairs that may be nearer than `within`, ordered by points.

    Facets of about the same size have a tree of their middles, so that a large one does not widen the search of others.
    """
    n, m = len(x), len(corners)
    if not within < _extent(corners):
        return np.repeat(np.arange(n), m), np.tile(np.arange(m), n)
    from scipy.spatial import cKDTree

    middles = corners.mean(axis=1)
    radii = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    classes = np.frexp(radii)[1]
    points, facets = [], []
    for one in np.unique(classes):
        own = np.flatnonzero(classes == one)
        found = cKDTree(middles[own]).query_ball_point(x, within + float(radii[own].max()), return_sorted=True)
        points.append(np.repeat(np.arange(n), [len(some) for some in found]))
        facets.append(own[np.concatenate([np.empty(0), *found]).astype(np.int64)])
    point, facet = np.concatenate(points), np.concatenate(facets)
    order = np.lexsort((facet, point))
    return point[order], facet[order]


def _extent(corners: Array) -> float:
    return float(np.ptp(corners, axis=(0, 1)).max())


def _nearest(
    found: Gaps,
    pairs: tuple[NDArray[np.int64], NDArray[np.int64]],
    away: Array,
    distances: Array,
    normals: Array,
    rounding: float,
) -> None:
    """Set the gaps of the points that occur in pairs (point, facet), which are ordered by points.

    away: vectors from the feet on the facets to the points; distances: their lengths; rounding: what is no distance.
    """
    point, facet = pairs
    if len(point) == 0:
        return
    starts = np.flatnonzero(np.diff(point, prepend=-1))
    which = np.cumsum(np.diff(point, prepend=-1) > 0) - 1  # number of the point among those that occur
    closest = np.minimum.reduceat(distances, starts)
    first = np.flatnonzero(distances == closest[which])
    nearest = first[np.flatnonzero(np.diff(which[first], prepend=-1))]
    direction = away[nearest]
    same = np.linalg.norm(away - direction[which], axis=1) <= rounding
    mean = np.add.reduceat(np.where(same[:, None], normals[facet], 0.0), starts)
    mean /= np.linalg.norm(mean, axis=1)[:, None]
    sign = np.where(np.einsum("nd,nd->n", direction, mean) < 0.0, -1.0, 1.0)
    resolved = (closest > rounding) & (np.add.reduceat(same.astype(int), starts) > 1)
    normal = np.where(resolved[:, None], sign[:, None] * direction, mean)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    height = np.where(same, np.einsum("pd,pd->p", away, normals[facet]), -np.inf)
    first = np.flatnonzero(height == np.maximum.reduceat(height, starts)[which])
    towards = first[np.flatnonzero(np.diff(which[first], prepend=-1))]
    at = point[starts]
    found.gap[at] = np.where(resolved, sign * closest, np.einsum("nd,nd->n", direction, mean))
    found.normal[at], found.facet[at] = normal, facet[np.where(resolved, towards, nearest)]


def unit_normals(corners: Array) -> Array:
    """Right-hand unit normals of segments or triangles with these corners, shape (m, dim)."""
    edges = corners[:, 1:] - corners[:, :1]
    if corners.shape[2] == 2:
        n = np.stack([edges[:, 0, 1], -edges[:, 0, 0]], axis=1)
    else:
        n = np.cross(edges[:, 0], edges[:, 1])
    return n / np.linalg.norm(n, axis=1)[:, None]


def feet(x: Array, corners: Array) -> Array:
    """The point of each segment or triangle that is nearest to the point of the same number, shape (n, dim)."""
    count = corners.shape[1]
    edges = [(corners[:, a], corners[:, b]) for b in range(count) for a in range(b)]
    found = np.stack([_on_segments(x, a, b) for a, b in edges])
    nearest = np.linalg.norm(x - found, axis=2).argmin(axis=0)
    foot = found[nearest, np.arange(len(x))]
    if count == 2:
        return foot
    n = unit_normals(corners)
    flat = x - np.einsum("nd,nd->n", x - corners[:, 0], n)[:, None] * n
    turns = [
        np.einsum("nd,nd->n", np.cross(corners[:, (i + 1) % 3] - corners[:, i], flat - corners[:, i]), n)
        for i in range(3)
    ]
    inside = np.min(turns, axis=0) >= 0.0
    return np.where(inside[:, None], flat, foot)


def _on_segments(x: Array, a: Array, b: Array) -> Array:
    along = b - a
    share = np.einsum("nd,nd->n", x - a, along) / np.einsum("nd,nd->n", along, along)
    return a + np.clip(share, 0.0, 1.0)[:, None] * along
