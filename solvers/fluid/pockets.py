"""Parts of the fluid that bodies and walls close off: nothing says how high the pressure in them is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy import ndimage

from solvers.fluid.cut import Cut
from solvers.fluid.grid import DistributedGrid

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Pocket:
    """Active cells that are connected with each other and with no part of the boundary that is open."""

    cells: Mask  #: local cells that belong to it
    largest: bool  #: no pocket has more cells
    elastic: bool  #: a surface that another field moves bounds it, by its elasticity its pressure may be known


def find_pockets(grid: DistributedGrid, cut: Cut, is_open: NDArray[np.int32], elastic: Mask) -> list[Pocket]:
    """All pockets, the same list on every process (collective).

    `is_open`: local cells at an open boundary; `elastic`: vertices that another field moves. Cells that share a vertex
    are connected, because they share unknowns.
    """
    box, own = grid.grid, cut.active[cut.active < grid.owned]
    active = np.zeros(box.size, dtype=bool)
    active[grid.numbers[own]] = True
    grid.comm.Allreduce(MPI.IN_PLACE, active, op=MPI.LOR)
    labels, count = ndimage.label(box.as_box(active), np.ones((3,) * grid.dim))
    labels = labels.ravel(order="F")[grid.numbers]
    at_elastic = elastic[cut.facets[cut.pieces.facet]].any(axis=1)
    marks = np.zeros((3, count + 1), dtype=np.int64)  # open cells, elastic pieces, cells of each part
    np.add.at(marks[0], labels[is_open], 1)
    np.add.at(marks[1], labels[cut.cut[cut.pieces.cell[at_elastic]]], 1)
    np.add.at(marks[2], labels[own], 1)
    marks = grid.comm.allreduce(marks)
    closed = [part for part in range(1, count + 1) if not marks[0, part]]
    largest = max(closed, key=lambda part: marks[2, part], default=0)
    return [Pocket(labels == part, part == largest, bool(marks[1, part])) for part in closed]
