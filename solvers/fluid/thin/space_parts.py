"""Parts of the fluid in the cells around surfaces, in 3D, and which parts of neighbouring cells are linked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from solvers.api import Array
from solvers.fluid.background.box import Grid
from solvers.fluid.cutting.pieces import NOTHING
from solvers.fluid.thin.cell_regions import CellRegions, SpaceRegion, cell_regions
from solvers.fluid.thin.regions import SAME

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class SpacePart:
    """A connected part of the fluid in a cell in 3D; see `regions.Region`, whose place it takes."""

    cell: int  #: number in the box
    share: float  #: its volume, as a share of the cell
    facets: frozenset[int] | None = None  #: facets that bound it in this cell; None: it is all fluid of the cell
    region: SpaceRegion | None = None
    flush: frozenset[int] = frozenset()  #: facets that lie in its faces
    surface: None = None  #: no part of a facet bounds it, but whole facets

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
    """(parts of the fluid, links (part, part of the next cell, axis), cells with surface or solid).

    around: layers of cells around surfaces in which parts are found.
    """
    fluid = 1.0 - moments.fraction
    regions = cell_regions(grid, facets, x, moments.fraction)
    cut = np.zeros(grid.size, dtype=bool)
    cut[regions.polygons.cell] = True
    special = cut | (fluid < 1.0 - SAME)
    special[moments.cells] = True
    shape = np.ones((3,) * grid.dim, dtype=bool)
    near = ndimage.binary_dilation(grid.as_box(special), shape, iterations=around).ravel(order="F")
    doubtful = np.zeros(grid.size, dtype=bool)
    doubtful[regions.doubtful] = True
    total = np.bincount(regions.cell, regions.share, grid.size)
    doubtful |= cut & (np.abs(total - fluid) > SAME)
    doubtful[regions.cell[regions.share < -SAME]] = True
    found = _kept(regions, moments, facets, fluid, doubtful)
    whole = near & (fluid > NOTHING) & (~cut | doubtful)
    order = np.argsort(np.concatenate([found.cells, np.flatnonzero(whole)]), kind="stable")
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.arange(len(order))
    of_cell = np.full(grid.size, -1)
    of_cell[whole] = number[len(found.cells) :]
    wholes = [
        SpacePart(cell, float(fluid[cell]), flush=frozenset(found.flush.get(cell, ())))
        for cell in np.flatnonzero(whole).tolist()
    ]
    everything = [*found.parts, *wholes]
    links = _links(grid, regions, np.append(number[: len(found.cells)], -1)[found.of_region], of_cell, cut)
    return [everything[k] for k in order], links, special


@dataclass(frozen=True)
class _Kept:
    parts: list[SpacePart]
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
    return _Kept(parts, regions.cell[kept], of_region, flush)


def _links(grid: Grid, regions: CellRegions, part: Indices, of_cell: Indices, cut: Mask) -> Indices:
    """Links across faces: at regions of cells with surface, and between cells without it.

    part: of each region; of_cell: the part that has all fluid of a cell, -1: there is none.
    """
    strides = np.cumprod([1, *grid.shape[:-1]])
    across = np.append(part, -1)[regions.of_face]
    beside = regions.cells_beside
    across = np.where((across < 0) & (beside >= 0), of_cell[beside], across)
    axis = regions.faces.faces[regions.faces.face] // regions.lattice.corners
    linked = (across >= 0).all(axis=1) & (regions.faces.area > SAME)
    found = [np.stack([*across[linked].T, axis[linked]], axis=1)]
    index = regions.lattice.index(np.arange(grid.size))
    for d, stride in enumerate(strides):
        low = np.flatnonzero((of_cell >= 0) & ~cut & (index[:, d] + 1 < grid.shape[d]))
        low = low[(of_cell[low + stride] >= 0) & ~cut[low + stride]]
        found.append(np.stack([of_cell[low], of_cell[low + stride], np.full(len(low), d)], axis=1))
    return np.unique(np.concatenate(found), axis=0)
