"""Triangles divided at vertices of others that lie in their edges, so that each edge belongs to the two beside it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from solvers.api import Array, Indices, Mask


def conforming(x: Array, triangles: Indices, near: float) -> tuple[Indices, Indices]:
    """(triangles that conform, the one of which each is a part).

    x: vertices [m], shape (n, 3); near [m]: distance from an edge up to which a vertex lies in it. Triangles one of
    whose vertices lies in their own edge have no area, and are left out.
    """
    a, b, c = x[triangles[:, 0]], x[triangles[:, 1]], x[triangles[:, 2]]
    longest = np.linalg.norm([b - a, c - b, a - c], axis=2).max(axis=0)
    of = np.flatnonzero(np.linalg.norm(np.cross(b - a, c - a), axis=1) > near * longest)
    edges = np.stack([triangles[of], np.roll(triangles[of], -1, axis=1)], axis=2)
    is_open = _open(edges.reshape(-1, 2)).reshape(-1, 3)
    ends = np.unique(edges[is_open])
    tree = cKDTree(x[ends]) if len(ends) else None
    found, parts = [], []
    for triangle, its_edges, some in zip(of.tolist(), edges, is_open, strict=True):
        inside = [_inside(x, edge, ends, tree, near) if it else [] for edge, it in zip(its_edges, some, strict=True)]
        divided = _divided(triangles[triangle].tolist(), inside)
        found += divided
        parts += [triangle] * len(divided)
    return np.array(found, dtype=np.int64).reshape(-1, 3), np.array(parts, dtype=np.int64)


def _open(edges: Indices) -> Mask:
    """Mask of the edges that do not occur as often in the other direction."""
    size = int(edges.max(initial=0)) + 1
    low, high = edges.min(axis=1), edges.max(axis=1)
    _, number = np.unique(low * size + high, return_inverse=True)
    sign = np.where(edges[:, 0] == low, 1.0, -1.0)
    return np.asarray(np.bincount(number, sign)[number] != 0.0)


def _inside(x: Array, edge: Indices, ends: Indices, tree: cKDTree | None, near: float) -> list[int]:
    """Vertices in an edge, from its begin to its end."""
    begin, along = x[edge[0]], x[edge[1]] - x[edge[0]]
    length = float(np.linalg.norm(along))
    assert tree is not None
    some = ends[tree.query_ball_point(begin + 0.5 * along, 0.5 * length + near)]
    at = (x[some] - begin) @ along / length
    off = np.linalg.norm(x[some] - begin - np.outer(at / length, along), axis=1)
    kept = (off <= near) & (at > near) & (at < length - near) & ~np.isin(some, edge)
    return [int(vertex) for vertex in some[kept][np.argsort(at[kept])]]


def _divided(triangle: list[int], inside: list[list[int]]) -> list[list[int]]:
    """Triangles of a triangle with vertices in its edges (0, 1), (1, 2), (2, 0); each one has an area."""
    for k, vertices in enumerate(inside):
        if vertices:
            (a, b, c), (_, after, before) = np.roll(triangle, -k).tolist(), inside[k:] + inside[:k]
            first, *rest = vertices
            return [*_divided([a, first, c], [[], [], before]), *_divided([first, b, c], [rest, after, []])]
    return [triangle]
