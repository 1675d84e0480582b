"""Pieces of surface: parts of facets, each in the cell whose fluid it bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.box import Grid
from solvers.lagrange import lagrange

#: Distance from a plane of the grid, in cells, up to which a piece lies in it.
FLUSH = 1e-6
#: Share of a cell (of its face) below which fluid (surface) in it is rounding error of the geometry.
NOTHING = 1e-10


@dataclass(frozen=True)
class Pieces:
    """Pieces of surface in local cut cells, sorted by cell."""

    cell: NDArray[np.int64]  #: index into the cut cells
    facet: NDArray[np.int64]
    moments: Array  #: int L_q lambda_v ds [m^(dim-1)], shape (pieces, points, dim)
    mass: Array  #: int lambda_v lambda_w ds, shape (pieces, dim, dim)
    normal: Array  #: unit normal out of the fluid, shape (pieces, dim)


def put_where_fluid_is(
    grid: Grid, points: Array, moments, normal: Array, full: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], Array]:
    """(cell of the box whose fluid each piece bounds, -1: none; moments of the piece in that cell).

    A piece in a `full` cell bounds no fluid there. If it lies in a face of the cell towards the fluid, it is moved to
    the cell behind this face: rounding decides on which side of the face the facet is.
    moments: result of the kernel; normal: out of the fluid, (pieces, dim); points: of the quadrature in one direction.
    """
    cell, found = moments.cells[moments.piece_cell], moments.piece_moments
    inside = np.flatnonzero(full[cell])
    if not len(inside):
        return cell, found
    found, count, dim = found.copy(), len(points), grid.dim
    behind = np.full(len(cell), -1)
    axes = np.argmax(np.abs(normal), axis=1)
    index = np.stack(np.unravel_index(cell, grid.shape, order="F"))
    for axis in range(dim):
        for side in (0, 1):
            at = inside[(axes[inside] == axis) & ((normal[inside, axis] < 0.0) == bool(side))]
            if not len(at):
                continue
            by_layer = np.moveaxis(found[at].reshape(len(at), *[count] * dim, dim), dim - axis, 1)
            across = by_layer.sum(axis=1)
            area = across.reshape(len(at), -1).sum(axis=1)
            square = np.einsum("pa,a->p", by_layer.reshape(len(at), count, -1).sum(axis=2), (points - side) ** 2)
            next_index = index[axis, at] + (1 if side else -1)
            flush = (square <= FLUSH**2 * area) & (next_index >= 0) & (next_index < grid.shape[axis])
            stride = int(np.prod(grid.shape[:axis]))
            behind[at[flush]] = cell[at[flush]] + (stride if side else -stride)
            moved = np.moveaxis(np.multiply.outer(lagrange(points, np.array(1.0 - side)), across), 1, 0)
            found[at] = np.moveaxis(moved, 1, dim - axis).reshape(len(at), -1, dim)
    behind[behind >= 0] = np.where(full[behind[behind >= 0]], -1, behind[behind >= 0])
    return np.where(full[cell], behind, cell), found
