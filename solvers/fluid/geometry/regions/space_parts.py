"""Parts of the fluid in the cells around surfaces, in 3D, and which parts of neighbouring cells are linked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy import ndimage

from solvers.api import Array, Indices, Mask
from solvers.fluid.geometry.pieces import NOTHING
from solvers.fluid.geometry.regions.cell_regions import CellRegions, SpaceRegion, cell_regions
from solvers.fluid.geometry.regions.face_regions import contains, outline
from solvers.fluid.geometry.regions.regions import SAME_POINT
from solvers.fluid.geometry.regions.sliced_facets import ragged, sliced_facets
from solvers.fluid.geometry.regions.touching_cells import (
    CLOSING,
    TouchingCells,
    TouchingRegion,
    touching_cells,
    touching_links,
)
from solvers.fluid.grid.box import Grid

#: A direction along which both sides of a body are one before the other, if it is not parallel to the surface.
OBLIQUE_DIRECTION = np.array([1.0, 2.0**0.5, 3.0**0.5])


@dataclass(frozen=True)
class SpacePart:
    """A connected part of the fluid in a cell in 3D; see `regions.Region`, whose place it takes."""

    cell: int  #: number in the box
    share: float  #: its volume, as a share of the cell
    facets: frozenset[int] | None = None  #: facets that bound it in this cell; None: it is all fluid of the cell
    region: SpaceRegion | TouchingRegion | None = None
    flush: frozenset[int] = frozenset()  #: facets that lie in its faces
    surface: Array | None = (
        None  #: where surfaces touch, (facet, corners) of triangles, shape (n, 10); None: whole facets
    )

    def integrals(self, points: Array) -> Array:
        """int L_q of the Lagrange basis on the tensor points, the first direction fastest, shape (points^3,)."""
        assert self.region is not None
        return self.region.integrals(points)

    def contains(self, x: Array) -> bool:
        """Whether a point of the cell lies in it."""
        return self.region is None or self.region.contains(x)

    def wet(self, axis: int, side: int, points: Array) -> Array:
        """int L_q over the wet part of a face, relative to the face; the lower one of its axes fastest."""
        assert self.region is not None
        found = self.region.on_face(axis, side, points)
        return (found if axis == 1 else found.T).ravel()


def parts_in_space(grid: Grid, moments, facets: Indices, x: Array, around: int):
    """(parts of the fluid, links (part, part of the next cell, axis), cells with surface or solid, cells that touch).

    around: layers of cells around surfaces in which parts are found.
    """
    fluid = 1.0 - moments.fraction
    polygons = sliced_facets(grid, facets, x)
    touching = touching_cells(grid, polygons, facets, x, moments.fraction)
    known = None if touching is None else touching.votes
    regions = cell_regions(grid, facets, x, moments.fraction, polygons, known)
    cut = np.zeros(grid.size, dtype=bool)
    cut[regions.polygons.cell] = True
    special = cut | (fluid < 1.0 - SAME_POINT)
    special[moments.cells] = True
    shape = np.ones((3,) * grid.dim, dtype=bool)
    near = ndimage.binary_dilation(grid.as_box(special), shape, iterations=around).ravel(order="F")
    doubtful = np.zeros(grid.size, dtype=bool)
    doubtful[regions.doubtful] = True
    total = np.bincount(regions.cell, regions.share, grid.size)
    doubtful |= cut & (np.abs(total - fluid) > SAME_POINT)
    doubtful[regions.cell[regions.share < -SAME_POINT]] = True
    if touching is not None:
        doubtful[touching.cells] = True
    found = _kept(regions, moments, facets, fluid, doubtful)
    whole = near & (fluid > NOTHING) & (~cut | doubtful)
    if touching is not None:
        whole[touching.cells] = False
    special_cells = np.zeros(0, dtype=np.int64) if touching is None else touching.cell
    in_cell = np.concatenate([found.cells, np.flatnonzero(whole), special_cells])
    towards = [_area_vectors(regions)[found.region], np.zeros((int(whole.sum()), 3))]
    towards += [] if touching is None else [touching.area_vectors()]
    order = np.lexsort((np.concatenate(towards) @ OBLIQUE_DIRECTION, in_cell))  # of the sides, wherever others change
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.arange(len(order))
    of_cell = np.full(grid.size, -1)
    of_cell[whole] = number[len(found.cells) : len(found.cells) + whole.sum()]
    wholes = [
        SpacePart(cell, float(fluid[cell]), flush=frozenset(found.flush.get(cell, ())))
        for cell in np.flatnonzero(whole).tolist()
    ]
    part = np.append(number[: len(found.cells)], -1)[found.of_region]
    links = _links(grid, regions, part, of_cell, cut)
    if touching is None:
        everything = [*found.parts, *wholes]
        return [everything[k] for k in order], links, special, np.zeros(0, dtype=np.int64)
    divided, own = _divided(grid, touching, regions, part, of_cell, number[len(number) - len(touching.cell) :])
    everything = [*found.parts, *wholes, *divided]
    links = np.unique(np.concatenate([links, own]), axis=0)
    return [everything[k] for k in order], links, special, touching.cells


def _area_vectors(regions: CellRegions) -> Array:
    """int n ds over the surface of regions, n out of the solid, relative to their cells."""
    polygon, step = ragged(regions.polygons.count - 2)
    a, b, c = regions.corners[polygon, 0], regions.corners[polygon, step + 1], regions.corners[polygon, step + 2]
    found = np.zeros((len(regions.cell), 3))
    of = regions.of_polygon[polygon]
    np.add.at(found, of[of >= 0], 0.5 * np.cross(b - a, c - a)[of >= 0])
    return found


@dataclass(frozen=True)
class _Kept:
    parts: list[SpacePart]
    region: Indices  #: of each part
    cells: Indices
    of_region: Indices  #: part of each region, -1: none
    flush: dict[int, set[int]]  #: facets in faces of cells without surface


def _kept(regions: CellRegions, moments, facets: Indices, fluid: Array, doubtful: Mask) -> _Kept:
    """Regions with volume. Others are what rounding leaves of facets in faces of cells: these bound the next cell."""
    in_kernel = np.unique(moments.cells[moments.piece_cell] * len(facets) + moments.piece_facet)
    bounding: list[frozenset[int]] = [regions.facets_of(k) for k in range(len(regions.cell))]
    keys = regions.polygons.cell * len(facets) + regions.polygons.facet
    has_piece = np.zeros(len(regions.cell), dtype=bool)
    has_piece[regions.of_polygon[np.isin(keys, in_kernel)]] = True
    nothing = (fluid[regions.cell] <= NOTHING) | ((regions.share < NOTHING) & ~has_piece)
    flush: dict[int, set[int]] = {}
    for region in np.flatnonzero(nothing & ~doubtful[regions.cell]).tolist():
        faces = regions.faces_of(region)
        if faces:
            _, side, number = max(faces, key=lambda face: regions.faces.area[face[2]])
            beside = int(regions.of_face[number, side])
            if beside >= 0:
                bounding[beside] |= bounding[region]
            else:
                flush.setdefault(int(regions.cells_beside[number, side]), set()).update(bounding[region])
    kept = np.flatnonzero(~nothing & ~doubtful[regions.cell])
    of_region = np.full(len(regions.cell), -1)
    of_region[kept] = np.arange(len(kept))
    parts = [
        SpacePart(int(regions.cell[k]), float(regions.share[k]), bounding[k], SpaceRegion(regions, int(k)))
        for k in kept.tolist()
    ]
    return _Kept(parts, kept, regions.cell[kept], of_region, flush)


def _links(grid: Grid, regions: CellRegions, part: Indices, of_cell: Indices, cut: Mask) -> Indices:
    """Links across faces: at regions of cells with surface, and between cells without it.

    part: of each region; of_cell: the part that has all fluid of a cell, -1: there is none.
    """
    strides = np.cumprod([1, *grid.shape[:-1]])
    across = np.append(part, -1)[regions.of_face]
    beside = regions.cells_beside
    across = np.where((across < 0) & (beside >= 0), of_cell[beside], across)
    axis = regions.faces.faces[regions.faces.face] // regions.lattice.corners
    linked = (across >= 0).all(axis=1) & (regions.faces.area > SAME_POINT)
    found = [np.stack([*across[linked].T, axis[linked]], axis=1)]
    index = regions.lattice.index(np.arange(grid.size))
    for d, stride in enumerate(strides):
        low = np.flatnonzero((of_cell >= 0) & ~cut & (index[:, d] + 1 < grid.shape[d]))
        low = low[(of_cell[low + stride] >= 0) & ~cut[low + stride]]
        found.append(np.stack([of_cell[low], of_cell[low + stride], np.full(len(low), d)], axis=1))
    return np.unique(np.concatenate(found), axis=0)


def _divided(
    grid: Grid, touching: TouchingCells, regions: CellRegions, part: Indices, of_cell: Indices, number: Indices
) -> tuple[list[SpacePart], Indices]:
    """(parts in cells where bodies touch, their links).

    part: of each region of other cells; of_cell: the part that has all fluid of a cell, -1: there is none; number: of
    the part of each region of cells where bodies touch.
    """
    on_face: dict[int, list[int]] = {}
    for region, face in enumerate(regions.faces.faces[regions.faces.face].tolist()):
        on_face.setdefault(face, []).append(region)

    outline_of = cache(lambda region: outline(regions.faces, regions.edges, region))
    face_of = cache(lambda cell, axis, side: int(regions.lattice.face(np.array([cell]), axis, side)[0]))

    def other_side(cell: int, axis: int, side: int, x: Array) -> int:
        plane = [(axis + 1) % 3, (axis + 2) % 3]
        if of_cell[cell] >= 0:
            return int(of_cell[cell])
        for region in on_face.get(face_of(cell, axis, side), ()):
            beside = regions.of_face[region, 1 - side]
            if beside >= 0 and part[beside] >= 0 and contains(*outline_of(region), x[plane]):
                return int(part[beside])
        return -1

    links, closed = touching_links(grid, touching, number, other_side)
    kind = touching.kind.copy()
    kind[closed] = CLOSING
    found = replace(touching, kind=kind)
    ends = np.stack([number[links[:, 0]], links[:, 2]], axis=1)
    ends = np.where(links[:, 1:2] == 1, ends, ends[:, ::-1])
    parts = []
    for k, (cell, share) in enumerate(zip(touching.cell.tolist(), touching.share.tolist(), strict=True)):
        mine = TouchingRegion(found, k)
        parts.append(SpacePart(cell, share, mine.facets, mine, surface=mine.surface))
    return parts, np.column_stack([ends, links[:, 3]])
