"""Regions: connected parts of the fluid, and which of them are closed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.pockets import regions
from solvers.fluid.flow.field import Fluid
from solvers.fluid.geometry.pieces import NOTHING


@dataclass(frozen=True)
class Regions:
    """Regions by number, from 0 on; the same on every process but for `of_cell`.

    Cells with fluid that share a vertex are connected. Cells behind surfaces, to which the flow is extended, are not
    among them.
    """

    of_cell: Indices  #: region of each local cell, -1 for cells of other processes and for those without fluid
    opened: NDArray[np.bool_]  #: a patch with a free normal velocity is at it
    closed: NDArray[np.bool_]  #: no such patch is at it, and it has a cell full of fluid
    volume: Array  #: [m^3]
    whole: list[Indices]  #: numbers in the box of the cells full of fluid, of closed regions


def regions_of(fluid: Fluid) -> Regions:
    """The regions of the present cut (collective)."""
    grid, cut, comm = fluid.grid, fluid.cut, fluid.comm
    uncut, partly = (some[some < grid.owned] for some in (cut.uncut, cut.cut))
    own = np.sort(np.concatenate([uncut, partly[cut.fraction[partly] > NOTHING]]))
    labels, count = regions(grid, own, fluid.unknowns.periodic)
    sums = np.zeros((3, count + 1))
    sums[0] = np.bincount(labels[own], cut.fraction[own] * grid.sizes[own].prod(axis=1), count + 1)
    sums[1] = np.bincount(labels[fluid.parts.boundary.open_cells()], minlength=count + 1)
    sums[2] = np.bincount(labels[uncut], minlength=count + 1)
    volume, opened, full = comm.allreduce(sums)[:, 1:]
    closed = (opened == 0.0) & (full > 0.0)
    mine = uncut[closed[labels[uncut] - 1]]
    parts = comm.allgather((grid.numbers[mine], labels[mine] - 1)) if closed.any() else [(np.empty(0, int),) * 2]
    numbers, region = (np.concatenate(column) for column in zip(*parts, strict=True))
    whole = [np.sort(numbers[region == number]) for number in range(count)]
    return Regions(labels - 1, opened > 0.0, closed, volume, whole)


def overlaps(fluid: Fluid, found: Regions, some: list[Indices]) -> NDArray[np.bool_]:
    """Whether each region has some of the cells of each list, shape (lists, regions) (collective).

    some: numbers in the box, sorted.
    """
    uncut = fluid.cut.uncut[fluid.cut.uncut < fluid.grid.owned]
    numbers, region = fluid.grid.numbers[uncut], found.of_cell[uncut]
    shared = np.zeros((len(some), len(found.closed)), dtype=np.int64)
    for row, cells in zip(shared, some, strict=True):
        row += np.bincount(region[np.isin(numbers, cells)], minlength=len(row))
    return np.asarray(fluid.comm.allreduce(shared)) > 0


class RegionsOfCut:
    """The regions of the present cut of a flow, found once (collective)."""

    def __init__(self, fluid: Fluid):
        self._fluid = fluid
        self._cut: Cut | None = None
        self._found: Regions | None = None

    def now(self) -> Regions:
        if self._found is None or self._cut is not self._fluid.cut:
            self._cut, self._found = self._fluid.cut, regions_of(self._fluid)
        return self._found
