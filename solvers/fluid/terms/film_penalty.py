"""Nitsche's least penalty in films, mu c with c = 4 |Gamma_K| / |K in fluid| (`cut.film.coercive`), as walls move.

It grows without bound as a film closes: a film of h/500 that opens by a tenth of itself changes it by a tenth, and
with it forces that are far larger than those of the film. Its relative change in a cell is

    dc / c = d|Gamma_K| / |Gamma_K| - int_Gamma_K n . dd / |K in fluid|.

The rows of the flow and the force on the surface change by c dr/dc and c df/dc times that. All pieces in a cell have
the same c, so that each depends on the motion of all: a product of two matrices over the cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices32
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.film import coercive
from solvers.fluid.geometry.pieces import NOTHING
from solvers.fluid.mesh.distributed_grid import DistributedGrid


def least_in_films(cut: Cut, grid: DistributedGrid) -> Array | float:
    """c [1/m] of all pieces of the cut, zero outside of films."""
    if cut.creeping is None:
        return 0.0
    pieces, cells = cut.pieces, cut.cut[cut.pieces.cell]
    return coercive(cut.creeping[grid.numbers[cells]], pieces.cell, fluid_of(cut, grid, cells), pieces.area.sum(axis=1))


def fluid_of(cut: Cut, grid: DistributedGrid, cells: Indices32) -> Array:
    """Volume of the fluid in some cells [m^dim]; infinite in closed films, whose penalty need not be larger."""
    share = np.where(cut.fraction[cells] > NOTHING, cut.fraction[cells], np.inf)
    volume: Array = share * grid.sizes[cells].prod(axis=1)
    return volume


@dataclass(frozen=True)
class PenaltyDerivatives:
    """Derivatives of rows and force by c, and of c by the motion of the vertices of some pieces."""

    cell: NDArray[np.int64]  #: of each piece, into `rows`
    growth: Array  #: dc / c by the motion of vertices [1/m], (pieces, vertices, dim)
    dofs: Indices32  #: local dofs of the rows, (cells, rows)
    rows: Array  #: c dr/dc, (cells, rows)
    force: Array  #: c df/dc on the vertices of pieces, (pieces, vertices, dim)


def penalty_derivatives(
    cell: Indices32, volume: Array, areas: tuple[Array, Array], n: Array, dofs: Indices32, parts: tuple[Array, Array]
) -> PenaltyDerivatives:
    """Derivatives of the pieces in some cells.

    cell: local number by pieces; volume: of the fluid in it [m^dim]; areas: int N_b ds of pieces, (pieces, vertices),
    and the derivative of their area by the motion of vertices, (pieces, vertices, dim); n: unit normals out of the
    fluid; dofs: local dofs of the rows, (pieces, rows); parts: c dr/dc and c df/dc of each piece alone.
    """
    _, first, of_piece = np.unique(cell, return_index=True, return_inverse=True)
    of_vertices, by_motion = areas
    area = np.bincount(of_piece, of_vertices.sum(axis=1))[of_piece]
    growth = by_motion / area[:, None, None] - of_vertices[:, :, None] * n[:, None] / volume[:, None, None]
    rows = np.zeros((len(first), dofs.shape[1]))
    np.add.at(rows, of_piece, parts[0])
    return PenaltyDerivatives(of_piece, growth, dofs[first], rows, parts[1])
