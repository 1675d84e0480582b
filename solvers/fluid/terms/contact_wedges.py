"""Wedges of fluid beside closed contact of thin bodies: the length over which Nitsche's penalty acts, with `q1q1`.

With k mu / h Nitsche's method is positive for films of the height g > 2 h / k only. A wedge between two thin bodies has
no well-cut cell for the cut penalty: its nodes reach 1,000 times the velocity of the flow. With k mu / g the form is
positive at any height (docs/theory_fluid.md, Bodies that touch or overlap). Before contact that does not act: a film
leaves by the slip that the lower penalty allows, because linear velocities have no other flow through it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from solvers.api import Array
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.film import LEAST_RATIO
from solvers.fluid.mesh.distributed_grid import DistributedGrid


def beside_contact(grid: DistributedGrid, cut: Cut) -> Array | None:
    """min(g, h) / h in the local cells, at least `LEAST`, and 1 away from contact; None if no contact is closed.

    g = 2 |K| / (A - |int n|) with the fluid |K| of a cell and its surface, of the area A: the height of a film, or the
    mean one of a wedge, and infinite at a plane. h: shortest edge of the cell.
    """
    assert grid.sheets is not None
    if not len(grid.sheets.closed):
        return None
    pieces, sizes, count = cut.pieces, grid.sizes[cut.cut], len(cut.cut)
    area = pieces.area.sum(axis=1)
    net = np.stack([np.bincount(pieces.cell, area * n, count) for n in pieces.normal.T], axis=1)
    facing = np.bincount(pieces.cell, area, count) - np.linalg.norm(net, axis=1)
    twice, h = 2.0 * cut.fraction[cut.cut] * sizes.prod(axis=1), sizes.min(axis=1)
    narrow = (facing * h > twice) & _around(grid)[grid.numbers[cut.cut]]
    found = np.ones(len(grid.numbers))
    found[cut.cut[narrow]] = np.maximum(twice[narrow] / (facing * h)[narrow], LEAST_RATIO)
    return found


def _around(grid: DistributedGrid) -> NDArray[np.bool_]:
    """Mask of the cells of the box in which bodies touched, and in 2D of those that share a node with one.

    Flaps in 2D fail without the cells around; in 3D they were not needed, and with them `valve_3d` repeats a step.
    """
    assert grid.sheets is not None
    closed = np.zeros(grid.grid.size, dtype=bool)
    closed[grid.sheets.closed] = True
    if grid.dim == 2:
        box = closed.reshape(grid.grid.shape, order="F")
        return ndimage.binary_dilation(box, np.ones((3, 3))).ravel(order="F")
    return closed
