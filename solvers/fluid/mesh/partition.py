"""Blocks of the lattice for the processes: contiguous, with few neighbours, and the same in every run.

A block is halved across its longest axis where the work on both sides is most equal, and so are the halves.
Source: Berger, Bokhari, IEEE Trans. Comput. C-36 (1987) 570-580 (recursive coordinate bisection).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers import kernels
from solvers.api import Array
from solvers.fluid.geometry.thin.sheets import Sheets
from solvers.fluid.grid.box import Grid
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import Motion, together

#: Work of a cut cell in that of an uncut one, which takes 12 us of a Newton iteration of `torus_wall`, linear solver
#: included; a cut one takes 23 us. Cells within bodies have none.
CUT = 2.0
#: The same of a piece of surface, of which a cut cell has about nine in 3D: 6 us where the surface moves, 14 us where
#: another field moves it, whose coupling blocks are needed, next to nothing where it rests.
COST_OF_MOVING, COST_OF_COUPLED = 0.5, 1.2


def work(grid: Grid, bodies: Sequence[ImmersedBody]) -> Array:
    """Work of the cells of a box, shape (cells,), with bodies where they start; uncut cells have 1."""
    known = [(body, x) for body in bodies if (x := body.at_start) is not None]
    if not known:
        return np.ones(grid.size)
    motions = [Motion(x, np.zeros_like(x)) for _, x in known]
    facets, motion = together([body.surface for body, _ in known], motions, grid.dim)
    points = np.array([0.25, 0.75])
    found = kernels.moments(grid.edges, points, motion.x, facets, np.ones(grid.size, dtype=bool))
    amount, cell = np.where(found.fraction >= 1.0, 0.0, 1.0), found.cells[found.piece_cell]
    amount[cell] = CUT
    of_facet = np.concatenate([np.full(len(body.surface.facets), _work_of_piece(body)) for body, _ in known])
    amount += np.bincount(cell, of_facet[found.piece_facet], grid.size)
    return amount


def _work_of_piece(body: ImmersedBody) -> float:
    if body.motion is None:
        return COST_OF_COUPLED
    return 0.0 if body.rests else COST_OF_MOVING


def blocks(shape: Sequence[int], amount: Array, parts: int) -> NDArray[np.int32]:
    """Process of each cell of a box, shape (cells,), first axis fastest; amount: work of the cells, shape (cells,)."""
    owner: NDArray[np.int32] = np.zeros(shape, dtype=np.int32, order="F")
    _halve(owner, amount.reshape(shape, order="F"), 0, parts)
    return owner.ravel(order="F")


def _halve(owner: NDArray[np.int32], amount: Array, first: int, parts: int) -> None:
    """Give a block of cells to the processes from `first` on."""
    owner[...] = first
    axis = int(np.argmax(owner.shape))
    planes = owner.shape[axis]
    if parts == 1 or planes == 1:
        return
    below = np.cumsum(amount.sum(axis=tuple(a for a in range(amount.ndim) if a != axis)))[:-1]
    share = (parts // 2) / parts * amount.sum()
    at = int(np.argmin(np.abs(below - share))) + 1
    for part, start, count in (
        (slice(0, at), first, parts // 2),
        (slice(at, planes), first + parts // 2, parts - parts // 2),
    ):
        where = (slice(None),) * axis + (part,)
        _halve(owner[where], amount[where], start, count)


def destinations(shape: Sequence[int], owner: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(processes, offsets) for each cell: its owner, then those with cells behind its faces, which know it as ghost."""
    box = owner.reshape(shape, order="F")
    found = [owner]
    for axis in range(box.ndim):
        for side in (-1, 1):
            beside = np.roll(box, side, axis)
            edge = (slice(None),) * axis + (0 if side == 1 else -1,)
            beside[edge] = box[edge]  # no cell there
            found.append(beside.ravel(order="F"))
    table = np.stack(found, axis=1)
    table[:, 1:].sort(axis=1)
    keep = np.ones(table.shape, dtype=bool)
    keep[:, 1:] = (table[:, 1:] != owner[:, None]) & (np.diff(table[:, 1:], axis=1, prepend=-1) != 0)
    offsets = np.concatenate([[0], np.cumsum(keep.sum(axis=1))]).astype(np.int32)
    return table[keep], offsets


def partition(
    comm: MPI.Comm, grid: Grid, bodies: Sequence[ImmersedBody], sheets: Sheets | None = None
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """`destinations` of all cells of a mesh on rank 0, nothing on the others.

    New cells of `sheets` belong to the process of the cell in their place, both cells of a pair to that of the first.
    """
    if comm.rank > 0:
        return np.empty(0, dtype=np.int32), np.zeros(1, dtype=np.int32)
    owner = blocks(grid.shape, work(grid, bodies), comm.size)
    found, offsets = destinations(grid.shape, owner)
    if sheets is None:
        return found, offsets
    places = sheets.cells.copy()
    places[sheets.singles + 1 :: 2] = places[sheets.singles :: 2]
    last = offsets[-1] + np.arange(1, len(places) + 1, dtype=np.int32)
    return np.concatenate([found, owner[places]]), np.concatenate([offsets, last])
