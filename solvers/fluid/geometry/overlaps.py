"""Cells in which bodies overlap: the solid there is the union of the bodies.

Moments of several bodies are sums over them. So an overlap counts twice: the solid may exceed the cell though there is
fluid in it, and surface inside of another body bounds no fluid. In such cells the moments are those of the regions of
the fluid in the table of cut cells. Between bodies that are apart there is fluid, however near they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices
from solvers.cut_cells import CellCutter, ClosedSurfaces
from solvers.fluid.geometry.bodies import closed_surfaces
from solvers.fluid.geometry.regions import (
    length_of_rounding,
    pieces_of_regions,
    touching_cells,
    with_several_bodies,
    within_reach,
)
from solvers.fluid.grid.box import Grid
from solvers.mesh.gauss import tensor_weights


@dataclass(frozen=True)
class Moments:
    """Integrals over a solid and its surface, named as those of `kernels.moments`."""

    fraction: Array
    cells: Indices
    solid: Array
    piece_cell: Indices
    piece_facet: Indices
    piece_moments: Array
    piece_mass: Array


class Unions:
    """Unions of bodies in cells of one grid; what does not move from one cut to the next is kept."""

    def __init__(self, grid: Grid, points: Array):
        self._grid, self._points = grid, points
        self._facets: Indices | None = None
        self._found: tuple[ClosedSurfaces, CellCutter] | None = None

    def __call__(self, moments, facets: Indices, x: Array, normal: Array, tied: NDArray[np.bool_] | None):
        """Moments with the union of the bodies as solid, in cells with fluid where they overlap; normals of its pieces.

        moments: of `kernels.moments`, which are returned where nothing overlaps or a surface is open; x: vertices [m];
        normal: of facets, out of the fluid; tied: those that are tied, in whose cells nothing overlaps; None: none is.
        """
        grid, dim, points = self._grid, self._grid.dim, self._points
        unchanged = moments, normal[moments.piece_facet]
        if (found := self._of(facets, x)) is None:
            return unchanged
        surfaces, cutter = found
        several = with_several_bodies(grid, moments, surfaces.body)
        if tied is not None:
            several[moments.cells[moments.piece_cell[tied[moments.piece_facet]]]] = False
        if not several.any():
            return unchanged
        table = cutter.cut(within_reach(grid, x))
        touching = touching_cells(grid, moments, table, several, facets, x)
        row_of = np.full(grid.size, -1)
        row_of[moments.cells] = np.arange(len(moments.cells))
        with_fluid = np.zeros(grid.size, dtype=bool)  # others are solid, and have walls for fluid that enters
        with_fluid[table.cell] = True
        row_of[~(touching & with_fluid)] = -1
        some, row = row_of[row_of >= 0], row_of[table.cell]
        if not len(some):
            return unchanged
        fraction, solid = moments.fraction.copy(), moments.solid.copy()
        solid[some], fraction[moments.cells[some]] = tensor_weights(len(points), dim), 1.0
        np.subtract.at(solid, row[row >= 0], table.moments[row >= 0])
        np.subtract.at(fraction, table.cell[row >= 0], table.share[row >= 0])
        new = pieces_of_regions(table, points, grid, facets, x, row)
        kept = ~np.isin(moments.piece_cell, some)
        pairs = (
            (moments.piece_cell, new.cell),
            (moments.piece_facet, new.facet),
            (moments.piece_moments, new.moments),
            (moments.piece_mass, new.mass),
        )
        joined = (np.concatenate([old[kept], more]) for old, more in pairs)
        return Moments(fraction, moments.cells, solid, *joined), np.concatenate([unchanged[1][kept], new.normal])

    def _of(self, facets: Indices, x: Array) -> tuple[ClosedSurfaces, CellCutter] | None:
        """The surfaces, with the bodies that they bound, and what cuts cells by them; None where one is open."""
        if self._facets is None or not np.array_equal(self._facets, facets):
            self._facets, self._found = facets, None
            if (surfaces := closed_surfaces(facets, x)) is not None:
                closing = length_of_rounding(self._grid)
                self._found = surfaces, CellCutter(self._grid.edges, self._points, surfaces, closing=closing)
        return self._found
