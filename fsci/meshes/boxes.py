"""Which points lie in which axis-parallel boxes."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def in_boxes(points: Array, low: Array, high: Array) -> tuple[Indices, Indices]:
    """(points, boxes): all pairs of a point (n, dim) in a box, by bins; low, high: corners of the boxes (m, dim)."""
    start, dim = low.min(axis=0), points.shape[1]
    per_axis = max(int(len(points) ** (1.0 / dim)), 1)
    width = np.maximum((high.max(axis=0) - start) / per_axis, np.finfo(float).tiny)
    shape = (per_axis,) * dim

    def bins(at: Array) -> Indices:
        return np.clip((at - start) / width, 0, per_axis - 1).astype(np.int64)

    bin_of = np.ravel_multi_index(tuple(bins(points).T), shape)
    order = np.argsort(bin_of, kind="stable")
    begin = np.searchsorted(bin_of[order], np.arange(per_axis**dim + 1))
    first, last = bins(low), bins(high)
    near = np.flatnonzero(_sums(np.diff(begin).reshape(shape), first, last))
    boxes, position = _spread(near, (last - first + 1)[near].prod(axis=1))
    counts = (last - first + 1)[boxes]
    index = np.empty((len(boxes), dim), dtype=np.int64)
    for axis in range(dim):
        position, index[:, axis] = np.divmod(position, counts[:, axis])
    number = np.ravel_multi_index(tuple((first[boxes] + index).T), shape)
    pairs, place = _spread(np.arange(len(boxes)), begin[number + 1] - begin[number])
    which, boxes = order[begin[number[pairs]] + place], boxes[pairs]
    inside = ((points[which] >= low[boxes]) & (points[which] <= high[boxes])).all(axis=1)
    return which[inside], boxes[inside]


def _sums(counts: Indices, first: Indices, last: Indices) -> Indices:
    """Sums of an array over ranges of its indices, both ends of them (n, dim), by its cumulative sums."""
    total = np.pad(counts, [(1, 0)] * counts.ndim)
    for axis in range(counts.ndim):
        total = total.cumsum(axis=axis)
    sums = np.zeros(len(first), dtype=np.int64)
    for ends in product((0, 1), repeat=counts.ndim):
        corner = np.where(np.array(ends, dtype=bool), last + 1, first)
        sums += (-1) ** (counts.ndim - sum(ends)) * total[tuple(corner.T)]
    return sums


def _spread(items: Indices, counts: Indices) -> tuple[Indices, Indices]:
    """(each item so many times, number of the repetition from 0 on)."""
    repeated = np.repeat(items, counts)
    ends = np.cumsum(counts)
    return repeated, np.arange(len(repeated)) - np.repeat(ends - counts, counts)
