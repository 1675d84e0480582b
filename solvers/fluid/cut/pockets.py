"""Pockets: parts of the fluid that bodies and walls enclose, so that no boundary condition determines the pressure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from solvers.algebra.connected import connected_parts
from solvers.api import Mask
from solvers.fluid.cut.cut import Cut
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.sheet_cells import connected_cells


@dataclass(frozen=True)
class Pocket:
    """A connected set of active cells without cells at an open boundary."""

    cells: Mask  #: mask of its owned cells, over local cells
    largest: bool  #: no pocket has more cells
    elastic: bool  #: bounded by a surface that another field moves, which may determine the pressure level


def find_pockets(
    grid: DistributedGrid,
    cut: Cut,
    coupled: NDArray[np.int32],
    is_open: NDArray[np.int32],
    elastic: Mask,
    periodic: Sequence[int] = (),
) -> list[Pocket]:
    """All pockets, the same list on every process (collective).

    coupled: sorted local cells with fluid, or through which the cut penalty couples others; is_open: those at an open
    boundary; elastic: mask of vertices that another field moves. Cells that share a vertex are connected, because they
    share unknowns, also across `periodic` axes.
    """
    own = coupled[coupled < grid.owned]
    labels, count = regions(grid, own, periodic)
    at_elastic = elastic[cut.facets[cut.pieces.facet]].any(axis=1)
    marks = np.zeros((3, count + 1), dtype=np.int64)  # open cells, elastic pieces, cells of each part
    np.add.at(marks[0], labels[is_open], 1)
    np.add.at(marks[1], labels[cut.cut[cut.pieces.cell[at_elastic]]], 1)
    marks[2] = np.bincount(labels[own], minlength=count + 1)
    marks = grid.comm.allreduce(marks)
    closed = [part for part in range(1, count + 1) if not marks[0, part]]
    largest = max(closed, key=lambda part: marks[2, part], default=0)
    return [Pocket(labels == part, part == largest, bool(marks[1, part])) for part in closed]


def regions(
    grid: DistributedGrid, own: NDArray[np.int32], periodic: Sequence[int] = ()
) -> tuple[NDArray[np.int64], int]:
    """Connected parts of sorted owned cells: (part of each local cell, from 1 on, 0 for others; count) (collective).

    Cells that share a vertex are connected. The parts have the same numbers on any number of processes.
    """
    if grid.joined:
        return connected_cells(grid, own)
    return _join(grid, *_label(grid, own), periodic)


def _label(grid: DistributedGrid, own: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Connected parts of this process: (part of each local cell, from 1 on, 0 for others; first cell of each part).

    The first cell is that with the smallest number, with the last axis fastest.
    """
    low, shape, indices = grid.window
    window = np.zeros(int(np.prod(shape)), dtype=bool)
    window[indices[own]] = True
    found, count = (np.zeros(0, dtype=np.int64), 0)
    if len(own):
        found, count = ndimage.label(window.reshape(shape), np.ones((3,) * grid.dim))
    found = found.ravel()
    labels = np.zeros(len(grid.numbers), dtype=np.int64)
    labels[own] = found[indices[own]]
    first = np.zeros(count + 1, dtype=np.int64)
    first[found[::-1]] = np.arange(len(found))[::-1]  # the last one assigned stays
    index = np.stack(np.unravel_index(first[1:], shape)) + low[:, None] if count else np.zeros((grid.dim, 0), dtype=int)
    return labels, np.ravel_multi_index(tuple(index), grid.grid.shape)


def _join(
    grid: DistributedGrid, labels: NDArray[np.int64], first: NDArray[np.int64], periodic: Sequence[int]
) -> tuple[NDArray[np.int64], int]:
    """Connected parts of all processes, joined at corners on seams: (part of each local cell, count) (collective)."""
    cells, corners = grid.seams(tuple(periodic))
    at, corners_in_all = labels[cells] > 0, int(np.prod([n + 1 for n in grid.grid.shape]))
    links = np.stack(np.divmod(np.unique(labels[cells[at]] * corners_in_all + corners[at]), corners_in_all))
    gathered = grid.comm.allgather((first, links))
    starts = np.concatenate([[0], np.cumsum([len(found) for found, _ in gathered])])
    firsts = np.concatenate([found for found, _ in gathered])
    parts = np.concatenate([start + these[0] - 1 for start, (_, these) in zip(starts, gathered, strict=False)])
    meetings = np.concatenate([these[1] for _, these in gathered])
    _, meetings = np.unique(meetings, return_inverse=True)
    size = len(firsts) + int(meetings.max(initial=-1)) + 1
    _, joined = np.unique(connected_parts(parts, len(firsts) + meetings, size), return_inverse=True)
    whole = int(joined.max(initial=-1)) + 1
    order = np.full(whole, np.iinfo(np.int64).max)
    np.minimum.at(order, joined[: len(firsts)], firsts)
    number = np.argsort(np.argsort(order)) + 1
    mine = joined[starts[grid.comm.rank] : starts[grid.comm.rank] + len(first)]
    return np.concatenate([[0], number[mine]])[labels], whole
