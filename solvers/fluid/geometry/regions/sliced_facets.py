"""Triangles of a surface divided by the planes of a grid: one polygon for each cell and facet, in 3D.

Corners on a plane count as above it, so that no corner lies in a plane. Each edge of a polygon is part of an edge of
its facet, or lies in a plane of the grid, and knows which. Neighbouring facets have exactly the same points on their
common edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.api import Array, Indices
from solvers.fluid.geometry.pieces import FLUSH
from solvers.fluid.grid.box import Grid

#: Kinds of edges of polygons: below it that many of the facet, from it on 2 axis + side of the plane of the cell.
IN_PLANE = 3


@dataclass(frozen=True)
class SlicedFacets:
    """Convex polygons, sorted by cell and facet; corners counterclockwise as seen from outside of the solid."""

    cell: Indices  #: number in the box, (polygons,)
    facet: Indices
    count: Indices  #: corners
    corners: Array  #: positions [m], shape (polygons, most corners, 3)
    kind: Indices  #: of the edge from each corner to the next one, shape (polygons, most corners)


def sliced_facets(grid: Grid, facets: Indices, x: Array) -> SlicedFacets:
    """Facets (m, 3) with vertices at x [m], divided into the cells of a grid; what is outside of it is left out."""
    count = np.full(len(facets), 3)
    corners, kind = x[facets], np.tile(np.arange(3), (len(facets), 1))
    facet, cell = np.arange(len(facets)), np.zeros(len(facets), dtype=np.int64)
    for axis, edge in enumerate(grid.edges):
        of, slab, count, corners, kind = _slabs(count, corners, kind, axis, edge)
        facet, cell = facet[of], cell[of] + slab * int(np.prod(grid.shape[:axis]))
    order = np.lexsort((facet, cell))
    return SlicedFacets(cell[order], facet[order], count[order], corners[order], kind[order])


def _slabs(
    count: Indices, corners: Array, kind: Indices, axis: int, edge: Array
) -> tuple[Indices, Indices, Indices, Array, Indices]:
    """Polygons divided by the planes across one axis: (polygon that each is a part of, slab, count, corners, kind)."""
    exists = np.arange(corners.shape[1]) < count[:, None]
    along, near = corners[:, :, axis], FLUSH * float(np.diff(edge).min())
    slab = np.searchsorted(edge, along, side="right") - 1
    slab = np.where(along <= edge[0] + near, -1, np.where(along >= edge[-1] - near, len(edge) - 1, slab))
    first = np.maximum(np.where(exists, slab, len(edge)).min(axis=1), 0)
    last = np.minimum(np.where(exists, slab, -1).max(axis=1), len(edge) - 2)
    of, step = ragged(np.maximum(last - first + 1, 0))
    k = first[of] + step
    count, corners, kind, slab, exists = count[of], corners[of], kind[of], slab[of], exists[of]
    following = np.where(np.arange(corners.shape[1]) + 1 < count[:, None], np.arange(corners.shape[1]) + 1, 0)
    there = np.take_along_axis(corners, following[:, :, None], axis=1)
    slab_there, own = np.take_along_axis(slab, following, axis=1), k[:, None]
    begins_within = exists & (slab == own)
    enters = exists & ((slab < own) & (slab_there >= own) | (slab > own) & (slab_there <= own))
    leaves = exists & ((slab <= own) & (slab_there > own) | (slab >= own) & (slab_there < own))
    upward = (slab_there > slab)[:, :, None]
    low, high = np.where(upward, corners, there), np.where(upward, there, corners)
    from_low = slab < own  # it enters at the lower plane
    to_high = slab_there > own
    new = np.stack(
        [corners, _crossing(low, high, axis, edge[own + ~from_low]), _crossing(low, high, axis, edge[own + to_high])], 2
    )
    width = 3 * corners.shape[1]
    new_kind = np.stack([kind, kind, IN_PLANE + 2 * axis + to_high], axis=2)
    used = np.stack([begins_within, enters, leaves], axis=2).reshape(len(of), width)
    number = used.sum(axis=1)
    order = np.argsort(~used, axis=1, kind="stable")[:, : int(number.max(initial=3))]
    new = np.take_along_axis(new.reshape(len(of), width, 3), order[:, :, None], axis=1)
    new_kind = np.take_along_axis(new_kind.reshape(len(of), width), order, axis=1)
    kept = number >= 3
    return of[kept], k[kept], number[kept], new[kept], new_kind[kept]


def _crossing(low: Array, high: Array, axis: int, plane: Array) -> Array:
    """Where edges cross a plane. The same point for both facets at an edge, and between its ends in each coordinate."""
    way = high - low
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.clip((plane - low[:, :, axis]) / way[:, :, axis], 0.0, 1.0)[:, :, None]
        found = np.where(t == 1.0, high, np.clip(low + t * way, np.minimum(low, high), np.maximum(low, high)))
    found[:, :, axis] = plane
    return found


def ragged(counts: Indices) -> tuple[Indices, Indices]:
    """(row, place in the row) of all entries of rows with these counts of entries."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
