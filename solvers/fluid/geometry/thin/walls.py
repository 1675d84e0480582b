"""Walls: bodies with fluid on both sides that is not connected around them, such as a ring full of fluid."""

from __future__ import annotations

import numpy as np

from solvers.api import Array, Indices, Mask
from solvers.cut_cells import components_of
from solvers.fluid.geometry.bodies import closed_surfaces, in_cavities
from solvers.fluid.geometry.thin.fluid_parts import COUNTS, Geometry
from solvers.fluid.grid.box import Grid


def facets_of_walls(grid: Grid, facets: Indices, x: Array) -> Mask:
    """Mask of the facets of walls; enclosed fluid counts if it fills a cell, or if a cavity of one body encloses it.

    Other fluid without a full cell is what bodies that touch leave between them.
    facets, x: as in `find_sheets`. None are walls if a surface is open.
    """
    if not len(facets) or (surfaces := closed_surfaces(facets, x)) is None:
        return np.zeros(len(facets), dtype=bool)
    table = Geometry(grid, surfaces, x).table(min(COUNTS))
    found = components_of(table)
    body, of_piece = surfaces.body[table.piece_facet], found.of_region[table.piece_region]
    shared = np.isin(of_piece, of_piece[~in_cavities(facets, x)[table.piece_facet]])
    counts = np.isin(of_piece, found.of_cell) | ~shared
    sides = np.unique(np.stack([body[counts], of_piece[counts]]), axis=1)[0]
    return np.asarray(np.bincount(sides, minlength=int(surfaces.body.max()) + 1)[surfaces.body] > 1)
