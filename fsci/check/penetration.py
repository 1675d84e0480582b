"""How deep points lie in a body, by its closed surface of segments or triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fsci.meshes.boxes import in_boxes

Array = NDArray[np.float64]
Facets = NDArray[np.int64]

#: Points of which the distance from all facets is computed: those that are farthest from its nodes.
DEEPEST = 20


def deepest(points: Array, x: Array, facets: Facets) -> float:
    """Largest depth [m] of points (n, dim) in a body with the surface x (m, dim), facets (k, dim).

    It is zero if all of them are outside. The depth of a point is its distance from the surface.
    """
    near = np.flatnonzero(((points > x.min(axis=0)) & (points < x.max(axis=0))).all(axis=1))
    corners = x[facets]
    inside = points[near[_winding(points[near], corners) > 0]] if len(near) else points[:0]
    if len(inside) > DEEPEST:
        from scipy.spatial import cKDTree

        distance, _ = cKDTree(x).query(inside)
        inside = inside[np.argsort(-distance, kind="stable")[:DEEPEST]]
    return float(_distance(inside, corners).max(initial=0.0))


def _winding(points: Array, corners: Array) -> NDArray[np.int64]:
    """How often the surface is around each point: its crossings of the ray along x, with the sign of their normals."""
    dim = points.shape[1]
    # a little beside the point, as rays through edges would count twice or never
    ray = points + np.array([0.0, 1.0, np.sqrt(2.0)])[:dim] * 1e-9 * np.ptp(corners, axis=(0, 1)).max()
    which, facet = in_boxes(ray[:, 1:], corners[:, :, 1:].min(axis=1), corners[:, :, 1:].max(axis=1))
    c, p = corners[facet], ray[which]
    if dim == 2:
        rise = c[:, 1, 1] - c[:, 0, 1]
        shares = np.stack([c[:, 1, 1] - p[:, 1], p[:, 1] - c[:, 0, 1]], axis=1)
    else:
        edges = [(1, 2), (2, 0), (0, 1)]
        shares = np.stack([_area(p[:, 1:], c[:, i, 1:], c[:, j, 1:]) for i, j in edges], axis=1)
        rise = _area(c[:, 0, 1:], c[:, 1, 1:], c[:, 2, 1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = shares / rise[:, None]
        meets = (shares >= 0.0).all(axis=1) & ((shares * c[:, :, 0]).sum(axis=1) > p[:, 0])
    return np.bincount(which[meets], np.sign(rise[meets]), len(points)).astype(np.int64)


def _area(a: Array, b: Array, c: Array) -> Array:
    """Twice the area of triangles in the plane, positive counterclockwise."""
    return np.asarray((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]))


def _distance(points: Array, corners: Array) -> Array:
    """Distance of each point from the nearest facet."""
    if not len(points):
        return np.empty(0)
    if points.shape[1] == 2:
        return _to_segments(points, corners[:, 0], corners[:, 1]).min(axis=1)
    edges = [(0, 1), (1, 2), (2, 0)]
    found = np.min([_to_segments(points, corners[:, i], corners[:, j]).min(axis=1) for i, j in edges], axis=0)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    normal = normal / np.where(size > 0.0, size, 1.0)[:, None]
    away = points[:, None] - corners[None, :, 0]
    height = np.einsum("pfi,fi->pf", away, normal)
    foot = points[:, None] - height[:, :, None] * normal
    on = np.ones(height.shape, dtype=bool)
    for i, j in edges:
        inward = np.cross(normal, corners[:, j] - corners[:, i])
        on &= np.einsum("pfi,fi->pf", foot - corners[None, :, i], inward) >= 0.0
    return np.minimum(found, np.where(on, np.abs(height), np.inf).min(axis=1))


def _to_segments(points: Array, start: Array, end: Array) -> Array:
    along = end - start
    squared = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = np.einsum("pfi,fi->pf", points[:, None] - start, along) / squared
    foot = start + share.clip(0.0, 1.0)[:, :, None] * along
    return np.asarray(np.linalg.norm(points[:, None] - foot, axis=2))
