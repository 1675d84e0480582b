"""Wet parts of the edges of cells that a surface cuts, in 3D: intervals between the points where it crosses them.

Edges and faces of cells have the number axis * corners + number of their lowest corner; the axis of a face is its
normal. The surface enters or leaves the solid at a crossing by the direction in which the polygon there runs around the
edge. That is exact, as the sign of the normal is not for facets along the edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from solvers.api import Array, Indices, Mask
from solvers.fluid.geometry.regions.sliced_facets import IN_PLANE, SlicedFacets, ragged
from solvers.fluid.grid.box import Grid


@dataclass(frozen=True)
class EdgeLattice:
    """Numbers of corners, edges and faces of the cells of a box in 3D."""

    grid: Grid

    @property
    def strides(self) -> Indices:
        """Steps of corner numbers along each axis."""
        return np.cumprod([1, *(n + 1 for n in self.grid.shape)])[:3]

    @property
    def corners(self) -> int:
        return int(np.prod([n + 1 for n in self.grid.shape]))

    def index(self, cells: Indices) -> Indices:
        """Indices of cells along each axis, shape (cells, 3)."""
        return np.stack(np.unravel_index(cells, self.grid.shape, order="F"), axis=1)

    def corner(self, cells: Indices) -> Indices:
        """Number of the lowest corner of cells."""
        return np.asarray(self.index(cells) @ self.strides)

    def face(self, cells: Indices, axis: int, side: int) -> Indices:
        """Number of a face of each cell."""
        return axis * self.corners + self.corner(cells) + side * self.strides[axis]


@dataclass(frozen=True)
class WetEdges:
    """Intervals of edges between crossings, edge by edge and upwards, and the crossings."""

    edges: Indices  #: their numbers, sorted
    count: Indices  #: intervals of each edge
    first: Indices  #: its first interval
    wet: Mask  #: (intervals,)
    ends: Array  #: from 0 to 1 along the edge, shape (intervals, 2)
    doubtful: Mask  #: edges whose crossings do not alternate: by rounding, or because bodies overlap
    facets: int
    crossing: Indices  #: edge * facets + facet of each crossing, sorted
    beside: Indices  #: the wet interval at each crossing

    def at(self, edge: Indices, facet: Indices) -> Indices:
        """The wet interval at the crossing of an edge, given by its number, with a facet; -1: there is none."""
        if not len(self.crossing):
            return np.full(len(edge), -1)
        key = edge * self.facets + facet
        found = np.minimum(np.searchsorted(self.crossing, key), len(self.crossing) - 1)
        return np.where(self.crossing[found] == key, self.beside[found], -1)


def wet_edges(
    lattice: EdgeLattice,
    polygons: SlicedFacets,
    facets: int,
    edges: Indices,
    fraction: Array,
    known: tuple[Indices, Indices] | None = None,
) -> WetEdges:
    """Wet parts of edges, given by their sorted numbers.

    fraction: share of solid of each cell of the box, which decides where no surface is; known: votes on corners of the
    lattice, (their numbers, positive: wet).
    """
    number, facet, upward_wet, at = _crossings(lattice, polygons)
    key, first = np.unique(number * facets + facet, return_index=True)
    row = np.searchsorted(edges, number[first])
    order = np.lexsort((at[first], row))
    row, wet_above, at, key = row[order], upward_wet[first][order], at[first][order], key[order]
    count = np.bincount(row, minlength=len(edges)) + 1
    start = np.cumsum(count) - count
    place = start[row] + np.arange(len(row)) - (np.cumsum(count - 1) - (count - 1))[row]  # the interval below each
    ends = np.stack([np.zeros(count.sum()), np.ones(count.sum())], axis=1)
    ends[place, 1] = ends[place + 1, 0] = at
    corner = edges % lattice.corners
    top = corner + lattice.strides[edges // lattice.corners]
    votes = _votes(lattice, polygons, fraction)
    lowest, highest = place == start[row], place + 1 == start[row] + count[row] - 1
    np.add.at(votes, corner[row[lowest]], np.where(wet_above[lowest], -1, 1))
    np.add.at(votes, top[row[highest]], np.where(wet_above[highest], 1, -1))
    if known is not None:
        np.add.at(votes, *known)
    plain = count == 1
    is_wet = _by_votes(votes, corner[plain], top[plain])
    wet = np.zeros(len(ends), dtype=bool)
    wet[start] = is_wet[corner]
    wet[place + 1] = wet_above
    doubtful = np.zeros(len(edges), dtype=bool)
    doubtful[row[wet[place] == wet_above]] = True
    doubtful[wet[start + count - 1] != is_wet[top]] = True
    beside, by_key = np.where(wet_above, place + 1, place), np.argsort(key)
    return WetEdges(edges, count, start, wet, ends, doubtful, facets, key[by_key], beside[by_key])


def _crossings(lattice: EdgeLattice, polygons: SlicedFacets) -> tuple[Indices, Indices, Mask, Array]:
    """(number of the edge, facet, whether fluid is above, place from 0 to 1) where facets cross edges of cells."""
    polygon, corner, before, after = corners_of(polygons)
    chosen = (before >= IN_PLANE) & (after >= IN_PLANE) & ((before - IN_PLANE) // 2 != (after - IN_PLANE) // 2)
    polygon, corner, before, after = polygon[chosen], corner[chosen], before[chosen], after[chosen]
    (axis_in, side_in), (axis_out, side_out) = (np.divmod(kind - IN_PLANE, 2) for kind in (before, after))
    axis = 3 - axis_in - axis_out
    cell = lattice.index(polygons.cell[polygon])
    lowest = cell @ lattice.strides + side_in * lattice.strides[axis_in] + side_out * lattice.strides[axis_out]
    # a polygon that runs counterclockwise about the axis has its normal along it
    wet_above = (axis_in == (axis + 2) % 3) == (side_in != side_out)
    x = polygons.corners[polygon, corner, axis]
    low, high = np.zeros(len(x)), np.ones(len(x))
    for d, edge in enumerate(lattice.grid.edges):
        on = axis == d
        low[on], high[on] = edge[cell[on, d]], edge[cell[on, d] + 1]
    return axis * lattice.corners + lowest, polygons.facet[polygon], wet_above, (x - low) / (high - low)


def corners_of(polygons: SlicedFacets) -> tuple[Indices, Indices, Indices, Indices]:
    """(polygon, corner, kind of the edge before, kind of the edge after) of all corners."""
    polygon, corner = ragged(polygons.count)
    last = np.where(corner == 0, polygons.count[polygon] - 1, corner - 1)
    return polygon, corner, polygons.kind[polygon, last], polygons.kind[polygon, corner]


def _votes(lattice: EdgeLattice, polygons: SlicedFacets, fraction: Array) -> Indices:
    """At each corner, how many cells without surface around it are full of fluid, minus those full of solid."""
    whole = np.where(fraction < 0.5, 1, -1)
    whole[np.isnan(fraction)] = 0
    whole[polygons.cell] = 0
    padded = np.pad(lattice.grid.as_box(whole), 1)
    votes = np.zeros([n + 1 for n in lattice.grid.shape], dtype=np.int64)
    for side in np.ndindex(2, 2, 2):
        votes += padded[tuple(slice(s, s + n + 1) for s, n in zip(side, lattice.grid.shape, strict=True))]
    return votes.ravel(order="F")


def _by_votes(votes: Indices, corner: Indices, top: Indices) -> Mask:
    """Whether corners are wet, by the votes of all corners that edges connect."""
    graph = sparse.coo_matrix((np.ones(len(corner)), (corner, top)), shape=(len(votes), len(votes)))
    group = connected_components(graph, directed=False)[1]
    return np.asarray(np.bincount(group, votes) > 0)[group]
