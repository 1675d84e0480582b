"""Regions of fluid on the faces of cells that a surface cuts, in 3D: parts of a square between chords and wet edges.

A chord is where a facet crosses the face. Regions are connected parts of the graph of chords and wet intervals of
edges; rounding has no part in it. A closed line of chords may be a hole in another region.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from solvers.api import Array, Indices, Mask
from solvers.fluid.geometry.regions.sliced_facets import IN_PLANE, SlicedFacets, ragged
from solvers.fluid.geometry.regions.wet_edges import EdgeLattice, WetEdges, corners_of

#: Area, relative to a face, below which a closed line of chords is a hole and not a region reduced to rounding.
HOLE = -1e-14


@dataclass(frozen=True)
class Chords:
    """Segments of surface on faces, with the fluid on their left as seen from above the face."""

    face: Indices  #: index among the faces
    facet: Indices
    below: Indices  #: polygon of the facet in the cell below the face, -1: outside of the box
    above: Indices
    ends: Array  #: in the two axes after the normal's, from 0 to 1, shape (chords, 2, 2)
    keys: Indices  #: where they end, equal for those that meet; negative: -1 - (row of `at_edges`), shape (chords, 2)
    at_edges: Indices  #: (side of the face: 0 and 1 the first, 2 and 3 the second axis, number of the edge)


@dataclass(frozen=True)
class FaceRegions:
    """Regions of fluid on faces, numbered from 0."""

    faces: Indices  #: numbers of the faces, sorted
    face: Indices  #: index of the face of each region
    area: Array  #: relative to the face
    chords: Chords
    of_chord: Indices  #: region of each chord
    #: wet intervals of the edges of faces: region, index among the faces, side of the face, interval
    of_interval: Indices
    doubtful: Mask  #: faces whose regions could not be found


def face_regions(
    lattice: EdgeLattice, polygons: SlicedFacets, x: Array, facets: Indices, faces: Indices, edges: WetEdges
) -> FaceRegions:
    """Regions on faces, given by their sorted numbers, with wet intervals of their edges; x [m]: vertices of facets."""
    chords = _chords(lattice, polygons, len(x), facets, faces)
    incident = np.searchsorted(edges.edges, edges_of(lattice, faces))  # index of the edge, shape (faces, 4)
    count = edges.count[incident]
    base = (np.cumsum(count) - count.ravel()).reshape(-1, 4)
    total = int(count.sum())
    side_of, place = ragged(count.ravel())
    interval = edges.first[incident].ravel()[side_of] + place
    wet = edges.wet[interval]
    first, last = base, base + count - 1
    one = [first[:, 0], last[:, 0], first[:, 1], last[:, 1]]
    two = [first[:, 2], first[:, 3], last[:, 2], last[:, 3]]
    doubtful = edges.doubtful[incident].any(axis=1)
    names, key = np.unique(chords.keys[chords.keys >= 0], return_inverse=True)
    number = total + np.arange(len(chords.face))
    chord, end = np.nonzero(chords.keys >= 0)
    one.append(number[chord])
    two.append(total + len(number) + key)
    chord, end = np.nonzero(chords.keys < 0)
    side, edge = chords.at_edges[-1 - chords.keys[chord, end]].T
    found = edges.at(edge, chords.facet[chord])
    known = found >= 0
    doubtful[chords.face[chord[~known]]] = True
    chord, side, edge, found = chord[known], side[known], edge[known], found[known]
    at = base[chords.face[chord], side] + found - edges.first[np.searchsorted(edges.edges, edge)]
    one.append(number[chord])
    two.append(at)
    size = total + len(number) + len(names)
    in_use = np.concatenate([wet, np.ones(size - total, dtype=bool)])
    ends = np.concatenate(one), np.concatenate(two)
    kept = in_use[ends[0]] & in_use[ends[1]]
    graph = sparse.coo_matrix((np.ones(kept.sum()), (ends[0][kept], ends[1][kept])), shape=(size, size))
    group = connected_components(graph, directed=False)[1]
    group = np.unique(group[np.concatenate([wet, np.ones(len(number), dtype=bool), np.zeros(len(names), dtype=bool)])],
                      return_inverse=True)[1]  # fmt: skip
    of_wet, of_chord = group[: wet.sum()], group[wet.sum() :]
    side_of, interval = side_of[wet], interval[wet]
    face, side = np.divmod(side_of, 4)
    regions = int(group.max(initial=-1)) + 1
    area, right = np.zeros(regions), side == 3
    np.add.at(area, of_chord, chords.ends[:, :, 0].mean(axis=1) * (chords.ends[:, 1, 1] - chords.ends[:, 0, 1]))
    np.add.at(area, of_wet[right], edges.ends[interval[right], 1] - edges.ends[interval[right], 0])
    face_of = np.zeros(regions, dtype=np.int64)
    face_of[of_wet], face_of[of_chord] = face, chords.face
    of_interval = np.stack([of_wet, face, side, interval], axis=1)
    found_regions = FaceRegions(faces, face_of, area, chords, of_chord, of_interval, doubtful)
    return _with_holes(found_regions, edges)


def edges_of(lattice: EdgeLattice, faces: Indices) -> Indices:
    """Numbers of the edges of faces: two along the first axis after the normal's, two along the second."""
    axis, corner = np.divmod(faces, lattice.corners)
    p, q = (axis + 1) % 3, (axis + 2) % 3
    along_p, along_q = p * lattice.corners + corner, q * lattice.corners + corner
    steps = lattice.strides
    return np.stack([along_p, along_p + steps[q], along_q, along_q + steps[p]], axis=1)


def _chords(lattice: EdgeLattice, polygons: SlicedFacets, vertices: int, facets: Indices, faces: Indices) -> Chords:
    polygon, corner, before, kind = corners_of(polygons)
    index = lattice.index(polygons.cell)
    axis, side = np.divmod(np.maximum(kind - IN_PLANE, 0), 2)
    chosen = (kind >= IN_PLANE) & ((side == 1) | (index[polygon, axis] == 0))  # once, and at the boundary of the box
    polygon, corner, axis, side, before = polygon[chosen], corner[chosen], axis[chosen], side[chosen], before[chosen]
    following = (corner + 1) % polygons.count[polygon]
    after = polygons.kind[polygon, following]
    cell, facet, up = polygons.cell[polygon], polygons.facet[polygon], side == 1
    face = axis * lattice.corners + lattice.corner(cell) + side * lattice.strides[axis]
    corners = np.stack([polygons.corners[polygon, corner], polygons.corners[polygon, following]], axis=1)
    corners = in_cells(lattice, cell, corners)
    plane = np.stack([(axis + 1) % 3, (axis + 2) % 3], axis=1)
    ends = np.take_along_axis(corners, np.repeat(plane[:, None, :], 2, axis=1), axis=2)
    ends = np.where(up[:, None, None], ends, ends[:, ::-1])
    kinds = np.where(up[:, None], np.stack([before, after], axis=1), np.stack([after, before], axis=1))
    other = polygon_at(polygons, len(facets), cell + np.cumprod([1, *lattice.grid.shape[:-1]])[axis], facet)
    inside = index[polygon, axis] + 1 < np.array(lattice.grid.shape)[axis]
    keys = np.empty((len(face), 2), dtype=np.int64)
    position, of_facets = np.searchsorted(faces, face), facet_edges(facets, vertices)
    at_edges: list[Indices] = []
    for end in (0, 1):
        of_facet = kinds[:, end] < IN_PLANE
        edge = of_facets[facet, np.minimum(kinds[:, end], 2)]
        keys[:, end] = position * of_facets.size + edge
        axis_there, side_there = np.divmod(kinds[:, end] - IN_PLANE, 2)
        first = axis_there == plane[:, 0]
        free = np.where(first, plane[:, 1], plane[:, 0])
        number = free * lattice.corners + face % lattice.corners + side_there * lattice.strides[axis_there % 3]
        rows = np.stack([np.where(first, 2, 0) + side_there, number], axis=1)[~of_facet]
        keys[~of_facet, end] = -1 - sum(len(some) for some in at_edges) - np.arange(len(rows))
        at_edges.append(rows)
    keys[keys >= 0] = np.unique(keys[keys >= 0], return_inverse=True)[1]
    return Chords(
        position,
        facet,
        np.where(up, polygon, -1),
        np.where(up, np.where(inside, other, -1), polygon),
        ends,
        keys,
        np.concatenate(at_edges),
    )


def in_cells(lattice: EdgeLattice, cells: Indices, x: Array) -> Array:
    """Points x [m] of shape (cells, n, 3) in reference coordinates of these cells."""
    found = np.empty(x.shape)
    index = lattice.index(cells)
    for axis, edge in enumerate(lattice.grid.edges):
        low = edge[index[:, axis], None]
        found[:, :, axis] = (x[:, :, axis] - low) / (edge[index[:, axis] + 1, None] - low)
    return found


def facet_edges(facets: Indices, vertices: int) -> Indices:
    """Numbers of the edges of facets, equal for facets that share them, shape (facets, 3)."""
    ends = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=2), axis=2)
    return np.unique(ends[:, :, 0] * vertices + ends[:, :, 1], return_inverse=True)[1].reshape(facets.shape)


def polygon_at(polygons: SlicedFacets, facets: int, cell: Indices, facet: Indices) -> Indices:
    """The polygon of a facet in a cell, -1: none."""
    keys = polygons.cell * facets + polygons.facet
    if not len(keys):
        return np.full(len(cell), -1)
    wanted = cell * facets + facet
    found = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.where(keys[found] == wanted, found, -1)


def _with_holes(regions: FaceRegions, edges: WetEdges) -> FaceRegions:
    """Closed lines of chords around a solid become part of the smallest region around them."""
    holes = np.flatnonzero(regions.area < HOLE)
    if not len(holes):
        return regions
    into, doubtful = np.arange(len(regions.area)), regions.doubtful.copy()
    for hole in holes:
        point = regions.chords.ends[np.flatnonzero(regions.of_chord == hole)[0], 0]
        others = np.flatnonzero((regions.face == regions.face[hole]) & (regions.area >= HOLE))
        around = [r for r in others if contains(*outline(regions, edges, int(r)), point)]
        if around:
            into[hole] = min(around, key=lambda r: regions.area[r])
        else:
            doubtful[regions.face[hole]] = True
    area = np.zeros(len(into))
    np.add.at(area, into, regions.area)
    of_interval = regions.of_interval.copy()
    of_interval[:, 0] = into[of_interval[:, 0]]
    return FaceRegions(regions.faces, regions.face, area, regions.chords, into[regions.of_chord], of_interval, doubtful)


def outline(regions: FaceRegions, edges: WetEdges, number: int) -> tuple[Array, Array]:
    """(chords of a region (n, 2, 2), its intervals on the far side of its first axis (m, 2))."""
    rows = regions.of_interval[(regions.of_interval[:, 0] == number) & (regions.of_interval[:, 2] == 3)]
    return regions.chords.ends[regions.of_chord == number], edges.ends[rows[:, 3]]


def contains(chords: Array, far: Array, x: Array) -> bool:
    """Whether a point is in a region of a square: a ray from it along the first axis leaves the region once more."""
    a, b = chords[:, 0], chords[:, 1]
    above = (a[:, 1] > x[1]) != (b[:, 1] > x[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        at = a[:, 0] + (x[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    crossed = int((above & (x[0] < at)).sum()) + int(((far[:, 0] <= x[1]) & (x[1] < far[:, 1])).sum())
    return crossed % 2 == 1
