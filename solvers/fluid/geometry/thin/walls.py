"""Walls: bodies with fluid on both sides that is not connected around them, such as a ring full of fluid."""

from __future__ import annotations

import numpy as np

from solvers.api import Array, Indices, Mask
from solvers.cut_cells import components_of
from solvers.fluid.geometry.bodies import closed_surfaces
from solvers.fluid.geometry.thin.fluid_parts import COUNTS, Geometry
from solvers.fluid.grid.box import Grid


def facets_of_walls(grid: Grid, facets: Indices, x: Array) -> Mask:
    """Mask of the facets of walls; fluid that is enclosed without a cell full of it does not count.

    facets, x: as in `find_sheets`. None are walls if a surface is open.
    """
    if not len(facets) or (surfaces := closed_surfaces(facets, x)) is None:
        return np.zeros(len(facets), dtype=bool)
    table = Geometry(grid, surfaces, x).table(min(COUNTS))
    found = components_of(table)
    body, of_piece = surfaces.body[table.piece_facet], found.of_region[table.piece_region]
    full = np.isin(of_piece, found.of_cell)
    sides = np.unique(np.stack([body[full], of_piece[full]]), axis=1)[0]
    return np.asarray(np.bincount(sides, minlength=int(surfaces.body.max()) + 1)[surfaces.body] > 1)
