"""Distances of points to a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.tessellation import unit_normals

#: Relative difference of distances that is none: of a point to two facets with a common edge.
SAME_DISTANCE = 1e-9

#: Height relative to the distance from a facet from which on a point is behind it and not beside it: 45 degrees.
WITHIN = np.sqrt(0.5)


def signed_distances(points: Array, normals: Array, x: Array, facets: NDArray[np.int64], facet_type: str) -> Array:
    """Distances [m] of points (n, dim) of a surface with these normals to facets with nodes at x [m], negative behind.

    Facets are divided into flat simplices. A point is behind the nearest one if it lies on its inner side, within 45
    degrees of its normal, and the normals of both surfaces are opposed.
    """
    simplices = np.array(CELL_TYPES[facet_type].simplices)
    corners = x[facets[:, simplices].reshape(-1, simplices.shape[1])]
    outward = unit_normals(corners)
    closest, best, sign = np.full(len(points), np.inf), np.zeros(len(points)), np.ones(len(points))
    for simplex, normal in zip(corners, outward, strict=True):
        distance = distances_in_pairs(points, np.broadcast_to(simplex, (len(points), *simplex.shape)))
        height = (points - simplex[0]) @ normal
        equal = distance <= closest * (1.0 + SAME_DISTANCE)
        better = (distance < closest * (1.0 - SAME_DISTANCE)) | (equal & (np.abs(height) > best))
        behind = (height < -WITHIN * distance) & (normals @ normal < 0.0)
        sign[better] = np.where(behind, -1.0, 1.0)[better]
        best[better] = np.abs(height)[better]
        closest = np.minimum(closest, distance)
    return np.asarray(sign * closest)


def nearest_points(points: Array, corners: Array) -> Array:
    """The points nearest to given ones, (n, dim), on segments or triangles with corners (m, dim, dim), all in [m]."""
    found, closest = points.copy(), np.full(len(points), np.inf)
    for simplex in corners:
        dim = len(simplex)
        feet = [_on_segment(points, simplex[a], simplex[b]) for a in range(dim) for b in range(a)]
        if dim == 3:
            feet.append(_on_plane(points, simplex))
        for foot in feet:
            distance = np.linalg.norm(points - foot, axis=1)
            nearer = distance < closest
            found[nearer], closest[nearer] = foot[nearer], distance[nearer]
    return found


def _on_segment(points: Array, a: Array, b: Array) -> Array:
    along = b - a
    size = float(along @ along)
    share = np.clip((points - a) @ along / size, 0.0, 1.0) if size > 0.0 else np.zeros(len(points))
    return np.asarray(a + share[:, None] * along)


def _on_plane(points: Array, corners: Array) -> Array:
    """Projections on the plane of a triangle that are inside of it, else infinite."""
    edges = (corners[1:] - corners[0]).T
    inverse = np.linalg.pinv(edges)
    shares = (points - corners[0]) @ inverse.T
    within = (shares >= 0.0).all(axis=1) & (shares.sum(axis=1) <= 1.0)
    return np.where(within[:, None], corners[0] + shares @ edges.T, np.inf)


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
