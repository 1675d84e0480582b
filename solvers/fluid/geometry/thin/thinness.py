"""Whether bodies are thin somewhere, from their surface alone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from solvers.api import Array, Indices, Mask
from solvers.fluid.geometry.bodies import bodies_of
from solvers.fluid.grid.box import Grid
from solvers.mesh.tessellation import unit_normals

#: Product of unit normals below which two surfaces face opposite directions: corners below 45 degrees.
OPPOSITE_NORMALS = -0.7
#: Points whose pairs are found together, to bound the memory; the answer does not depend on it.
POINTS_AT_ONCE = 256
ALIKE_NORMALS = 4  #: normals of facets in one cell whose components differ by less than 1 / ALIKE_NORMALS count as one


def may_be_thin(grid: Grid, facets: Indices, x: Array, thick: float, body: Indices | None = None) -> bool:
    """Whether two parts of a surface face opposite directions with less than `thick` cells of solid between them.

    body: of each facet, `solid_of`; None: all are of one. Between two bodies that nearly touch is no solid.
    """
    if not len(facets):
        return False
    cell = max(float(cell_sizes_at(edge, x[:, axis]).max()) for axis, edge in enumerate(grid.edges))
    body = np.zeros(len(facets), dtype=np.int64) if body is None else body
    if grid.dim == 2:
        points, normal, of = _on_segments(x[facets], cell)
        apart = np.column_stack([points / (thick * cell), 2.0 * body[of]])
        pairs = iter([cKDTree(apart).query_pairs(1.0, output_type="ndarray").T])
    else:
        points, normal, of = _on_triangles(x[facets], cell, body)
        pairs = _opposed(np.column_stack([points / (thick * cell), 2.0 * body[of]]), normal)
    sizes = np.stack([cell_sizes_at(edge, points[:, axis]) for axis, edge in enumerate(grid.edges)], axis=1)
    size = 1.0 / np.linalg.norm(normal / sizes, axis=1)
    for first, second in pairs:
        opposed = np.einsum("pi,pi->p", normal[first], normal[second]) < OPPOSITE_NORMALS
        way = points[second] - points[first]
        behind = np.einsum("pi,pi->p", way, normal[first]) <= 0.0
        close = np.linalg.norm(way, axis=1) <= thick * np.maximum(size[first], size[second])
        if (opposed & behind & close).any():
            return True
    return False


def solid_of(facets: Indices, x: Array, tied: Mask | None) -> Indices:
    """Body of each facet, from 0 on; bodies with tied facets (a mask, None: there are none) count as one."""
    body = bodies_of(facets, x)
    if tied is not None and tied.any():
        body = np.where(np.isin(body, body[tied]), body[tied].min(), body)
    return body


def _opposed(points: Array, normal: Array) -> Iterator[Array]:
    """Pairs (of indices, each twice) of points up to 1 apart with opposed normals, and some more, shape (2, pairs).

    The last coordinate of points keeps bodies 2 apart.
    Opposed normals n, m have |n + m|^2 = 2 + 2 n m below a bound, so that both are close to each other in a space of
    points and normals. There are few such pairs if nothing is thin, and hundreds for each point if something is: then
    those of the first points answer the question.
    """
    bound = 2.0 + 2.0 * OPPOSITE_NORMALS
    at, numbers = points * np.sqrt(bound), np.arange(len(points))
    other = cKDTree(np.concatenate([at, -normal], axis=1))
    for some in np.array_split(numbers, -(-len(points) // POINTS_AT_ONCE)):
        one = cKDTree(np.concatenate([at[some], normal[some]], axis=1))
        found = one.sparse_distance_matrix(other, np.sqrt(2.0 * bound), output_type="ndarray")
        yield np.stack([some[found["i"]], found["j"]])


def cell_sizes_at(edge: Array, x: Array) -> Array:
    """Edge lengths [m] of the cells at coordinates x [m]."""
    return np.diff(edge)[np.clip(np.searchsorted(edge, x) - 1, 0, len(edge) - 2)]


def _on_segments(ends: Array, cell: float) -> tuple[Array, Array, Indices]:
    """(points, their normals, their segments) on segments, at most a cell apart."""
    a, b = ends[:, 0], ends[:, 1]
    length = np.linalg.norm(b - a, axis=1)
    count = np.maximum(1, np.ceil(length / cell)).astype(int)
    of = np.repeat(np.arange(len(ends)), count)
    part = (np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[of]
    along = (b - a) / np.where(length > 0.0, length, 1.0)[:, None]
    return a[of] + part[:, None] * (b - a)[of], np.stack([along[:, 1], -along[:, 0]], axis=1)[of], of


def _on_triangles(corners: Array, cell: float, body: Indices) -> tuple[Array, Array, Indices]:
    """(points, their normals, their triangles) on triangles, at most a cell apart.

    One for all of a body that are alike in a cube as large as a cell.
    """
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    count = np.maximum(1, np.ceil(longest / cell)).astype(int)
    normals, points, normal, triangle = unit_normals(corners), [], [], []
    for n in np.unique(count):
        # middles of the n^2 triangles into which a triangle is divided, by their barycentric coordinates
        i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
        up, down = i + j < n, i + j < n - 1
        st = np.concatenate([np.stack([i, j], axis=2)[up] + 1.0 / 3.0, np.stack([i, j], axis=2)[down] + 2.0 / 3.0]) / n
        weights = np.column_stack([1.0 - st.sum(axis=1), st])
        some = count == n
        points.append(np.einsum("sv,tvi->tsi", weights, corners[some]).reshape(-1, 3))
        normal.append(np.repeat(normals[some], len(st), axis=0))
        triangle.append(np.repeat(np.flatnonzero(some), len(st)))
    at, way, of = np.concatenate(points), np.concatenate(normal), np.concatenate(triangle)
    keys = np.column_stack([np.floor(at / cell), np.round(ALIKE_NORMALS * way), body[of]])
    first = np.sort(np.unique(keys, axis=0, return_index=True)[1])
    return at[first], way[first], of[first]
