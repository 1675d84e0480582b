"""The surface by pieces, each in the cell whose fluid it bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.box import Grid

#: Distance from a plane of the grid, in cells, up to which a piece lies in it.
FLUSH = 1e-6
#: Share of a cell (of its face) below which fluid (surface) in it is rounding error of the geometry.
NOTHING = 1e-10


@dataclass(frozen=True)
class Pieces:
    """The surface by pieces, each in one cut cell that this process owns or knows; sorted by cell."""

    cell: NDArray[np.int64]  #: index into the cut cells
    facet: NDArray[np.int64]
    moments: Array  #: int L_q lambda_v ds [m^(dim-1)], shape (pieces, points, dim)
    mass: Array  #: int lambda_v lambda_w ds, shape (pieces, dim, dim)
    normal: Array  #: unit normal out of the fluid, shape (pieces, dim)


def put_where_fluid_is(
    grid: Grid, points: Array, moments, normal: Array, full: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], Array]:
    """Cell of the box that each piece of a kernel's result bounds, -1 if there is no fluid, and its moments there.

    In a `full` cell none does; but a piece that lies in the face towards the fluid belongs to the cell behind that
    face: rounding decides on which side of its plane a facet is. `normal` (pieces, dim) points out of the fluid,
    `points` are those of the rule in one direction.
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
            place = index[axis, at] + (1 if side else -1)
            flush = (square <= FLUSH**2 * area) & (place >= 0) & (place < grid.shape[axis])
            stride = int(np.prod(grid.shape[:axis]))
            behind[at[flush]] = cell[at[flush]] + (stride if side else -stride)
            moved = np.moveaxis(np.multiply.outer(_values(points, 1.0 - side), across), 1, 0)
            found[at] = np.moveaxis(moved, 1, dim - axis).reshape(len(at), -1, dim)
    behind[behind >= 0] = np.where(full[behind[behind >= 0]], -1, behind[behind >= 0])
    return np.where(full[cell], behind, cell), found


def _values(points: Array, x: float) -> Array:
    """The Lagrange polynomials on some points at x."""
    return np.linalg.solve(np.vander(points, increasing=True).T, x ** np.arange(len(points)))
