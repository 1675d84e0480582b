"""Parts of the fluid that bodies and walls close off: nothing says how high the pressure in them is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from solvers.fluid.cut import Cut
from solvers.fluid.grid import DistributedGrid

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Pocket:
    """Active cells that are connected with each other and with no part of the boundary that is open."""

    cells: Mask  #: which local cells belong to it; cells of other processes are left out
    largest: bool  #: no pocket has more cells
    elastic: bool  #: a surface that another field moves bounds it, by its elasticity its pressure may be known


def find_pockets(
    grid: DistributedGrid, cut: Cut, is_open: NDArray[np.int32], elastic: Mask, periodic: Sequence[int] = ()
) -> list[Pocket]:
    """All pockets, the same list on every process (collective).

    `is_open`: local cells at an open boundary; `elastic`: vertices that another field moves. Cells that share a vertex
    are connected, because they share unknowns; those at the ends of `periodic` axes share them across the period.
    """
    own = cut.active[cut.active < grid.owned]
    labels, count = _join(grid, *_label(grid, own), own, periodic)
    at_elastic = elastic[cut.facets[cut.pieces.facet]].any(axis=1)
    marks = np.zeros((3, count + 1), dtype=np.int64)  # open cells, elastic pieces, cells of each part
    np.add.at(marks[0], labels[is_open], 1)
    np.add.at(marks[1], labels[cut.cut[cut.pieces.cell[at_elastic]]], 1)
    np.add.at(marks[2], labels[own], 1)
    marks = grid.comm.allreduce(marks)
    closed = [part for part in range(1, count + 1) if not marks[0, part]]
    largest = max(closed, key=lambda part: marks[2, part], default=0)
    return [Pocket(labels == part, part == largest, bool(marks[1, part])) for part in closed]


def _label(grid: DistributedGrid, own: NDArray[np.int32]) -> tuple[NDArray[np.int64], int]:
    """Parts of this process alone: the number of that of each local cell, from 1 on, 0 where none is; how many."""
    labels = np.zeros(len(grid.numbers), dtype=np.int64)
    if not len(own):
        return labels, 0
    index = np.stack(np.unravel_index(grid.numbers[own], grid.grid.shape, order="F"))
    low = index.min(axis=1)
    place = tuple(index - low[:, None])
    window = np.zeros(index.max(axis=1) - low + 1, dtype=bool)
    window[place] = True
    found, count = ndimage.label(window, np.ones((3,) * grid.dim))
    labels[own] = found[place]
    return labels, count


def _join(
    grid: DistributedGrid, labels: NDArray[np.int64], count: int, own: NDArray[np.int32], periodic: Sequence[int]
) -> tuple[NDArray[np.int64], int]:
    """The same of the parts of all processes together: they meet in corners on the seams between them (collective)."""
    cells, corners = grid.seams(tuple(periodic))
    at = labels[cells] > 0
    links = np.unique(np.stack([labels[cells[at]] - 1, corners[at]]), axis=1)
    first = _first_cells(grid, labels, count, own)
    gathered = grid.comm.allgather((first, links))
    starts = np.concatenate([[0], np.cumsum([len(found) for found, _ in gathered])])
    firsts = np.concatenate([found for found, _ in gathered])
    parts = np.concatenate([start + these[0] for start, (_, these) in zip(starts, gathered, strict=False)])
    meetings = np.concatenate([these[1] for _, these in gathered])
    _, meetings = np.unique(meetings, return_inverse=True)
    size = len(firsts) + int(meetings.max(initial=-1)) + 1
    graph = sparse.coo_matrix((np.ones(len(parts)), (parts, len(firsts) + meetings)), shape=(size, size))
    whole, joined = csgraph.connected_components(graph, directed=False)
    order = np.full(whole, np.iinfo(np.int64).max)
    np.minimum.at(order, joined[: len(firsts)], firsts)
    number = np.argsort(np.argsort(order)) + 1
    mine = joined[starts[grid.comm.rank] : starts[grid.comm.rank] + count]
    return np.concatenate([[0], number[mine]])[labels], whole


def _first_cells(
    grid: DistributedGrid, labels: NDArray[np.int64], count: int, own: NDArray[np.int32]
) -> NDArray[np.int64]:
    """Smallest number of a cell in each part of this process, the last axis running fastest."""
    shape = grid.grid.shape
    numbers = np.ravel_multi_index(np.unravel_index(grid.numbers[own], shape, order="F"), shape)
    first = np.full(count, np.iinfo(np.int64).max)
    np.minimum.at(first, labels[own] - 1, numbers)
    return first
