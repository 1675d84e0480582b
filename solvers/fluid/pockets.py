"""Parts of the fluid that bodies and walls close off: nothing says how high the pressure in them is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from solvers.fluid.cut import Cut
from solvers.fluid.grid import DistributedGrid

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Pocket:
    """Active cells that are connected with each other and with no part of the boundary that is open."""

    cells: Mask  #: local cells that belong to it
    largest: bool  #: no pocket has more cells
    elastic: bool  #: a surface that another field moves bounds it, by its elasticity its pressure may be known


def find_pockets(
    grid: DistributedGrid, cut: Cut, is_open: NDArray[np.int32], elastic: Mask, periodic: Sequence[int] = ()
) -> list[Pocket]:
    """All pockets, the same list on every process (collective).

    `is_open`: local cells at an open boundary; `elastic`: vertices that another field moves. Cells that share a vertex
    are connected, because they share unknowns; those at the ends of `periodic` axes share them across the period.
    """
    box, own = grid.grid, cut.active[cut.active < grid.owned]
    active = np.zeros(box.size, dtype=bool)
    active[grid.numbers[own]] = True
    grid.comm.Allreduce(MPI.IN_PLACE, active, op=MPI.LOR)
    labels, count = _label(box.as_box(active), periodic)
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


def _label(active: Mask, periodic: Sequence[int]) -> tuple[NDArray[np.int64], int]:
    """(number of the connected part of each cell, from 1 on, 0 where inactive; how many parts there are)."""
    width = [(1, 1) if axis in periodic else (0, 0) for axis in range(active.ndim)]
    padded, count = ndimage.label(np.pad(active, width, mode="wrap"), np.ones((3,) * active.ndim))
    inner = padded[tuple(slice(before, n - after) for (before, after), n in zip(width, padded.shape, strict=True))]
    if not periodic:
        return inner, count
    images = np.stack([padded.ravel(), np.pad(inner, width, mode="wrap").ravel()])
    images = images[:, (images > 0).all(axis=0)]
    links = sparse.coo_matrix((np.ones(images.shape[1]), images), shape=(count + 1,) * 2)
    parts = csgraph.connected_components(links, directed=False)[1]  # that of 0, which has no links, is 0
    return parts[inner].astype(np.int64), int(parts.max())
