"""Cells in bodies that are tied to each other: solid, whatever lies between the two sides of a tie.

Facets of two meshes that are tied lie on each other only up to arcs and rounding. Between them are slits and overlaps
that belong to no fluid.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.geometry.overlaps import Moments
from solvers.fluid.geometry.pieces import NOTHING
from solvers.fluid.grid.box import Grid
from solvers.mesh.gauss import tensor_weights


def slivers_of(grid: Grid) -> Array:
    """For each cell of the box the area of surface [m^(dim-1)] that is neglected."""
    sizes = grid.cell_sizes()
    return np.asarray(NOTHING * sizes.prod(axis=1) / sizes.max(axis=1))


def without_slits(
    moments, points: Array, tied: NDArray[np.bool_], counts: NDArray[np.bool_], slivers: Array
) -> Moments:
    """Moments with whole solid cells around tied facets, where no other surface bounds a fluid.

    moments: of `kernels.moments`; points: of the quadrature in one direction; tied, counts: masks of the facets that
    are tied and of those that the flow acts on; slivers: see `slivers_of`.
    """
    cell = moments.cells[moments.piece_cell]
    area = moments.piece_mass.sum(axis=(1, 2)) * counts[moments.piece_facet]
    bounds = np.bincount(cell, area, len(slivers)) > slivers
    whole = np.zeros(len(slivers), dtype=bool)
    whole[cell[tied[moments.piece_facet]]] = True
    return filled(moments, points, whole & ~bounds)


def filled(moments, points: Array, whole: NDArray[np.bool_]) -> Moments:
    """Moments with whole solid cells; whole: mask of these among the cells of the box."""
    fraction, solid = moments.fraction.copy(), moments.solid.copy()
    fraction[whole] = 1.0
    dim = moments.piece_mass.shape[1]
    solid[whole[moments.cells]] = tensor_weights(len(points), dim)
    kept = ~whole[moments.cells[moments.piece_cell]]
    pieces = (moments.piece_cell, moments.piece_facet, moments.piece_moments, moments.piece_mass)
    return Moments(fraction, moments.cells, solid, *(part[kept] for part in pieces))
