"""2D as one layer of cells in 3D: segments become walls that stand across the layer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers.api import Array, Indices
from solvers.cut_cells.table import CutTable


def walls(facets: Indices, body: Indices) -> tuple[Indices, Indices]:
    """(triangles, body of each) of walls on segments, closed above and below, on vertices of `wall_vertices`.

    Triangles 2 i and 2 i + 1 are those on segment i. The ends are fans about a vertex of each body: they overlap
    themselves, but turn about a point as often as the body does, and no cell meets them.
    """
    low, high = 2 * facets, 2 * facets + 1
    sides = np.stack([low[:, 0], low[:, 1], high[:, 1], low[:, 0], high[:, 1], high[:, 0]], axis=1).reshape(-1, 3)
    bodies, first = np.unique(body, return_index=True)
    centre = facets[first[np.searchsorted(bodies, body)], 0]
    below = np.stack([2 * centre, low[:, 1], low[:, 0]], axis=1)
    above = np.stack([2 * centre + 1, high[:, 0], high[:, 1]], axis=1)
    some = (facets != centre[:, None]).all(axis=1)
    triangles = np.concatenate([sides, below[some], above[some]])
    return triangles, np.concatenate([np.repeat(body, 2), body[some], body[some]])


def wall_vertices(x: Array, height: float) -> Array:
    """Vertices of walls from -height to 2 height, of each vertex of the plane the lower and the upper one."""
    return np.column_stack([np.repeat(x, 2, axis=0), np.tile([-height, 2.0 * height], len(x))])


def flattened(table: CutTable, height: float) -> CutTable:
    """The table of a layer of this height [m], with one point across it, as that of its plane."""
    piece_region, piece_facet, piece_body, piece_moments = _of_segments(
        height, table.piece_region, table.piece_facet, table.piece_body, table.piece_moments
    )
    closed_cell, closed_facet, _, closed_moments = _of_segments(
        height, table.closed_cell, table.closed_facet, table.closed_facet, table.closed_moments
    )
    return replace(
        table,
        shape=table.shape[:2],
        vertices=np.ascontiguousarray(table.vertices[::2, :2]),
        piece_region=piece_region,
        piece_facet=piece_facet,
        piece_body=piece_body,
        piece_moments=piece_moments,
        closed_cell=closed_cell,
        closed_facet=closed_facet,
        closed_moments=closed_moments,
    )


def _of_segments(
    height: float, place: Indices, facet: Indices, body: Indices, moments: Array
) -> tuple[Indices, Indices, Indices, Array]:
    """(place, segment, body, moments) of pieces of segments from those of their triangles, sorted by place."""
    segment, second = np.divmod(facet, 2)
    ends = np.zeros((2, 3, 2))  # the end of the segment that each vertex of its two triangles stands on
    ends[0, [0, 1, 2], [0, 1, 1]] = ends[1, [0, 1, 2], [0, 1, 0]] = 1.0
    pieces = moments @ ends[second] / height
    first = np.flatnonzero(np.diff(place * (segment.max(initial=0) + 1) + segment, prepend=-1))
    return place[first], segment[first], body[first], np.add.reduceat(pieces, first) if len(first) else pieces
