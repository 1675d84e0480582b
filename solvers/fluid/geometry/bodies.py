"""The bodies that closed surfaces bound, as `cut_cells` needs them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices
from solvers.cut_cells import ClosedSurfaces, CutTable
from solvers.mesh.penetration import windings

PIECE_COLUMNS = ("piece_region", "piece_facet", "piece_body", "piece_moments")
CLOSED_COLUMNS = ("closed_cell", "closed_facet", "closed_moments")


def bodies_of(facets: Indices, x: Array) -> Indices:
    """Body of each facet, from 0 on: connected surfaces, a cavity with the surface around it.

    facets: segments or triangles, shape (m, dim), with vertices at x [m].
    """
    edges = np.concatenate([facets[:, k : k + 2] for k in range(facets.shape[1] - 1)])
    part = connected_parts(edges[:, 0], edges[:, 1], len(x))[facets[:, 0]]
    parts, body = np.unique(part, return_inverse=True)
    if len(parts) < 2:
        return body
    corners = x[facets]
    volume = np.bincount(body, np.linalg.det(corners - corners.mean(axis=(0, 1))))
    body_of = np.arange(len(parts))
    for cavity in np.flatnonzero(volume < 0.0).tolist():
        point = corners[np.flatnonzero(body == cavity)[:1], 0]
        outer = [k for k in np.flatnonzero(volume > 0.0).tolist() if windings(point, corners[body == k])[0] > 0.5]
        if outer:
            body_of[cavity] = min(outer, key=lambda k: volume[k])
    return np.unique(body_of, return_inverse=True)[1][body]


def closed_surfaces(facets: Indices, x: Array) -> ClosedSurfaces:
    """Surfaces of bodies, closed by facets without area where vertices lie in edges of others, at the end.

    facets, x: as for `bodies_of`. ValueError where a surface is open.
    """
    body = bodies_of(facets, x)
    more = _fans(facets, x) if facets.shape[1] == 3 else facets[:0]
    if not len(more):
        return ClosedSurfaces(facets, body)
    of_vertex = np.full(len(x), -1)
    of_vertex[facets] = body[:, None]
    return ClosedSurfaces(np.concatenate([facets, more]), np.concatenate([body, of_vertex[more[:, 0]]]))


def without_fans(table: CutTable, facets: int) -> CutTable:
    """The table without pieces of the facets that `closed_surfaces` added to so many."""
    pieces, closed = table.piece_facet < facets, table.closed_facet < facets
    if pieces.all() and closed.all():
        return table
    rows = {name: getattr(table, name)[pieces] for name in PIECE_COLUMNS}
    return replace(table, **rows, **{name: getattr(table, name)[closed] for name in CLOSED_COLUMNS})


def _fans(triangles: Indices, x: Array) -> Indices:
    """Triangles that fill loops of edges which belong to facets on one side only, shape (n, 3)."""
    ends = np.stack([triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()], axis=1)
    edges, number = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    excess = np.bincount(number.ravel(), np.where(ends[:, 0] < ends[:, 1], 1.0, -1.0), len(edges)).astype(int)
    following: dict[int, list[int]] = {}
    for (low, high), count in zip(edges[excess != 0].tolist(), excess[excess != 0].tolist(), strict=True):
        start, end = (high, low) if count > 0 else (low, high)
        following.setdefault(start, []).extend([end] * abs(count))
    found = []
    while following:
        start = min(following)
        path = [start]
        while following.get(path[-1]):
            ahead = following[path[-1]]
            path.append(ahead.pop(_straightest(x, path, ahead)))
            if path[-1] in path[:-1]:  # a loop is closed
                first = path.index(path[-1])
                found += [(path[first], a, b) for a, b in pairwise(path[first + 1 : -1])]
                path = path[: first + 1]
        following = {vertex: ends for vertex, ends in following.items() if ends}
    return np.array(found, dtype=np.int64).reshape(-1, 3)


def _straightest(x: Array, path: list[int], ahead: list[int]) -> int:
    """Which of some vertices is nearest to the line through the last two of a path."""
    if len(path) < 2 or len(ahead) == 1:
        return 0
    along = x[path[-1]] - x[path[-2]]
    ways = x[ahead] - x[path[-1]]
    return int(np.argmin(np.linalg.norm(np.cross(ways, along), axis=1) / np.linalg.norm(ways, axis=1)))
