"""Parts of the fluid in the cells around surfaces, and which parts of neighbouring cells are linked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np
from scipy import ndimage

from solvers.api import Array, Indices, Mask
from solvers.cut_cells import CellCutter, CellState, ClosedSurfaces, CutTable, components_of
from solvers.fluid.geometry.pieces import NOTHING, place_of
from solvers.fluid.geometry.regions import (
    SAME_VOLUME,
    closing_length,
    largest_faces,
    touching_cells,
    with_several_bodies,
    within_reach,
)
from solvers.fluid.grid.box import Grid
from solvers.mesh.gauss import gauss
from solvers.mesh.lagrange import lagrange
from solvers.mesh.tessellation import unit_normals

LAYERS_AROUND = 3  #: layers of cells around surfaces in which parts and links are found

COUNTS = (2, 3, 5)  #: points in one direction that tables can have

#: A direction along which both sides of a body are one before the other, if it is not parallel to the surface.
OBLIQUE_DIRECTION = np.array([1.0, 2.0**0.5, 3.0**0.5])

BESIDE_POINT = 1e-3  #: half of the edge of the cell around a point whose region is looked for, relative to the cell


@dataclass(frozen=True)
class Geometry:
    """A grid and closed surfaces in it, and its tables."""

    grid: Grid
    surfaces: ClosedSurfaces
    x: Array  #: vertices [m]
    cutters: dict[int, CellCutter] = field(default_factory=dict)  #: by Gauss points; shared with other positions

    def followed(self, surfaces: ClosedSurfaces, x: Array) -> Geometry:
        """The same grid at another position; cells are kept none of whose facets moved."""
        same = (np.array_equal(getattr(self.surfaces, k), getattr(surfaces, k)) for k in ("facets", "body"))
        return Geometry(self.grid, surfaces, x, self.cutters if all(same) else {})

    @cached_property
    def table(self) -> Callable[[int], CutTable]:
        """The table for so many Gauss points in each direction, of `COUNTS`; regions are the same for all."""
        return cache(self._of_grid)

    def _of_grid(self, count: int) -> CutTable:
        if count not in self.cutters:
            self.cutters[count] = self._cutter(self.grid.edges, count)
        return self.cutters[count].cut(within_reach(self.grid, self.x))

    def cut(self, edges: Sequence[Array], count: int) -> CutTable:
        """The table of these grid lines."""
        return self._cutter(edges, count).cut(within_reach(self.grid, self.x), keep=False)

    def _cutter(self, edges: Sequence[Array], count: int) -> CellCutter:
        return CellCutter(edges, gauss(count)[0], self.surfaces, closing=closing_length(self.grid))


@dataclass(frozen=True)
class FluidParts:
    """Connected parts of the fluid in the cells around surfaces, sorted by cell."""

    geometry: Geometry
    cell: Indices  #: number in the box
    share: Array  #: volume, as a share of the cell
    region: Indices  #: in the table, -1: all fluid of a cell without surface, or of one whose regions are not known
    links: Indices  #: (part, part of the next cell, axis), sorted
    special: Mask  #: cells with surface or solid
    touching: Indices  #: cells in which bodies touch or overlap, sorted
    pieces: Indices  #: (part, facet that bounds it), sorted, shape (n, 2)

    def facets(self, part: int) -> frozenset[int]:
        """Facets that bound a part."""
        first, last = np.searchsorted(self.pieces[:, 0], [part, part + 1])
        return frozenset(self.pieces[first:last, 1].tolist())

    def facing(self) -> Array:
        """Mean unit normal of the facets in each part, shape (parts, dim); nan without facets."""
        part, facet = self.pieces.T
        normals = unit_normals(self.geometry.x[self.geometry.surfaces.facets])
        total = np.zeros((len(self.cell), normals.shape[1]))
        np.add.at(total, part, normals[facet])
        total /= np.maximum(np.linalg.norm(total, axis=1), SAME_VOLUME)[:, None]
        total[np.bincount(part, minlength=len(total)) == 0] = np.nan
        return total

    def integrals(self, part: int, points: Array) -> Array:
        """int L_q / |K| of a part with a region, on Gauss points in each direction, shape (points^dim,)."""
        return self.geometry.table(len(points)).moments[self.region[part]]

    def wet(self, part: int, axis: int, side: int, points: Array) -> Array:
        """int L_q over the open part of a face of a part with a region, relative to the face.

        points: Gauss points in one direction; the lower one of the face's axes is the fastest.
        """
        count = len(points)
        table = self.geometry.table(count if count in COUNTS else max(COUNTS))
        rows = (table.face_regions[:, 1 - side] == self.region[part]) & (table.face_axis == axis)
        found = table.face_moments[rows].sum(axis=0)
        if count in COUNTS:
            return np.asarray(found)
        to, dim = lagrange(points, gauss(max(COUNTS))[0]), len(table.shape)
        return np.asarray(found @ to if dim == 2 else (to.T @ found.reshape(len(to), -1) @ to).ravel())

    def region_at(self, cell: int, s: Array) -> int:
        """Region of the table that has the fluid at s, in the reference coordinates of a cell; -1: there is none.

        A small cell around the point is cut out of the cell. The fluid that is connected to it is the region.
        """
        low, size = (some[0] for some in place_of(self.geometry.grid, np.array([cell])))
        stops = [np.unique(np.clip([0.0, a - BESIDE_POINT, a + BESIDE_POINT, 1.0], 0.0, 1.0)) for a in s]
        there = [np.clip(np.searchsorted(stop, a) - 1, 0, len(stop) - 2) for stop, a in zip(stops, s, strict=True)]
        edges = [a + h * stop for a, h, stop in zip(low, size, stops, strict=True)]
        small = self.geometry.cut(edges, min(COUNTS))
        components = components_of(small)
        at = int(np.ravel_multi_index(there, small.shape, order="F"))
        if small.state[at] == CellState.SOLID:
            return -1
        own = np.flatnonzero(small.cell == at)
        number = components.of_region[own[np.argmax(small.share[own])]] if len(own) else components.of_cell[at]
        around = set(small.piece_facet[components.of_region[small.piece_region] == number].tolist())
        table = self.geometry.table(3)
        first, last = np.searchsorted(table.cell, [cell, cell + 1])
        bounding = {
            k: set(table.piece_facet[slice(*np.searchsorted(table.piece_region, [k, k + 1]))].tolist())
            for k in range(first, last)
        }
        return min(bounding, key=lambda k: len(bounding[k] ^ around), default=-1)


def parts_of_fluid(
    grid: Grid, moments, surfaces: ClosedSurfaces, x: Array, before: Geometry | None = None
) -> FluidParts:
    """Parts of the fluid around surfaces with vertices at x [m]; before: of an earlier position on this grid.

    moments: of `kernels.moments`; cells that these count as solid but for rounding have no parts, unless surfaces touch
    there.
    Where one body overlaps itself its regions are not known, and all fluid of the cell is one part.
    """
    geometry = Geometry(grid, surfaces, x) if before is None else before.followed(surfaces, x)
    table, fluid = geometry.table(3), 1.0 - moments.fraction
    special = (table.state != CellState.FLUID) | (fluid < 1.0 - SAME_VOLUME)
    special[moments.cells] = True
    several = with_several_bodies(grid, moments, geometry.surfaces.body)
    meeting = touching_cells(grid, moments, table, several, surfaces.facets, x)
    total = np.bincount(table.cell, table.share, grid.size)
    with_surface = np.zeros(grid.size, dtype=bool)
    with_surface[moments.cells[moments.piece_cell]] = True
    filled = (fluid <= NOTHING) & ~(with_surface & meeting)  # as in the cut, which has no fluid in them either
    closed = np.bincount(table.closed_cell, table.closed_moments.sum(axis=(1, 2)), grid.size)
    rounding = SAME_VOLUME + closing_length(grid) * closed / grid.cell_sizes().prod(axis=1)
    unknown = ~several & (np.abs(total - fluid) > rounding) & (table.state != CellState.FLUID)
    known = (table.state == CellState.CUT) & ~unknown & ~filled

    area, face = np.bincount(table.piece_region, table.piece_area, len(table.cell)), largest_faces(grid)
    kept = np.flatnonzero(known[table.cell] & ((table.share > NOTHING) | (area > NOTHING * face[table.cell])))
    whole = np.flatnonzero(grown(grid, special, LAYERS_AROUND) & ~filled & (fluid > NOTHING) & (
        (table.state == CellState.FLUID) | unknown
    ))  # fmt: skip
    cell, region = np.concatenate([table.cell[kept], whole]), np.concatenate([kept, np.full(len(whole), -1)])
    order = np.lexsort((_towards(table, geometry)[region] * (region >= 0), cell))
    cell, region = cell[order], region[order]
    share = np.where(region >= 0, table.share[region], fluid[cell]) if len(table.share) else fluid[cell]
    part = np.full(len(table.cell) + 1, -1)
    part[region[region >= 0]] = np.flatnonzero(region >= 0)
    part_of_cell = np.full(grid.size, -1)
    part_of_cell[cell[region < 0]] = np.flatnonzero(region < 0)
    pieces = np.stack([part[table.piece_region], table.piece_facet], axis=1)
    in_unknown = unknown[moments.cells[moments.piece_cell]]
    rest = part_of_cell[moments.cells[moments.piece_cell][in_unknown]]
    pieces = np.concatenate([pieces, np.stack([rest, moments.piece_facet[in_unknown]], axis=1)])
    pieces = np.unique(pieces[pieces[:, 0] >= 0], axis=0)
    links = _links(grid, table, part, part_of_cell)
    return FluidParts(geometry, cell, share, region, links, special, np.flatnonzero(meeting), pieces)


def _towards(table: CutTable, geometry: Geometry) -> Array:
    """int n ds over the surface of each region along `OBLIQUE_DIRECTION`, which orders the parts of a cell."""
    normal = unit_normals(geometry.x[geometry.surfaces.facets])
    along = normal[table.piece_facet] @ OBLIQUE_DIRECTION[: normal.shape[1]]
    return np.asarray(np.bincount(table.piece_region, table.piece_area * along, len(table.cell) + 1), dtype=float)


def _links(grid: Grid, table: CutTable, part: Indices, part_of_cell: Indices) -> Indices:
    """(part, part of the next cell, axis), sorted; part: of each region; part_of_cell: that has all fluid of a cell."""
    inside = (table.face_cells >= 0).all(axis=1) & (table.face_area > SAME_VOLUME)
    cells, regions = table.face_cells[inside], table.face_regions[inside]
    ends = np.where(regions >= 0, part[regions], part_of_cell[cells])
    ends = np.where((ends < 0) & (part_of_cell[cells] >= 0), part_of_cell[cells], ends)
    found = [np.column_stack([ends, table.face_axis[inside]])[(ends >= 0).all(axis=1)]]
    box = grid.as_box(np.where(table.state == CellState.CUT, -1, part_of_cell))
    for axis in range(grid.dim):
        low, high = (box.take(np.arange(grid.shape[axis] - 1) + side, axis).ravel() for side in (0, 1))
        both = (low >= 0) & (high >= 0)
        found.append(np.column_stack([low[both], high[both], np.full(int(both.sum()), axis)]))
    return np.unique(np.concatenate(found), axis=0)


def grown(grid: Grid, cells: Mask, layers: int) -> Mask:
    """These cells and so many layers around them."""
    shape = np.ones((3,) * grid.dim, dtype=bool)
    return ndimage.binary_dilation(grid.as_box(cells), shape, iterations=layers).ravel(order="F")


def ragged(counts: Indices) -> tuple[Indices, Indices]:
    """(row, place in the row) of all entries of rows with these counts of entries."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)


def join(wanted: Indices, values: Indices, keys: Indices) -> tuple[Indices, Indices]:
    """All pairs (position in `wanted`, value with this key)."""
    order = np.argsort(keys, kind="stable")
    low, high = (np.searchsorted(keys[order], wanted, side=side) for side in ("left", "right"))
    at, place = ragged(high - low)
    return at, values[order[place + low[at]]]
