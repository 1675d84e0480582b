"""Sparse matrices from sums of small dense blocks; several matrices share the search for blocks that coincide."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.sparse import Sparse, compiled


class OverlappingBlocks:
    """Positions of blocks of r rows and c columns: block i is in row block rows[i] and column block columns[i].

    Row block a has the rows a r ... a r + r - 1. The columns of column block b are numbers[i] of any i with
    columns[i] = b. Blocks at the same position add up.
    """

    def __init__(self, rows: NDArray, columns: NDArray, numbers: NDArray, shape: tuple[int, int], scalars: int):
        """rows, columns: shape (n,); numbers: (n, c); shape: counts of row and column blocks; scalars: columns."""
        self._rows, self._columns = shape[0], scalars
        key = rows.astype(np.int64) * shape[1] + columns
        order = np.argsort(key, kind="stable")
        new = np.ones(len(key), dtype=bool)
        new[1:] = np.diff(key[order]) > 0
        starts = np.flatnonzero(new)
        first = order[starts]
        self._order, self._starts = order.astype(np.int32), np.append(starts, len(key)).astype(np.int32)
        #: row block of each position, and the first position of each row block
        self._row, self._begins = rows[first], np.searchsorted(rows[first], np.arange(shape[0] + 1))
        self._numbers = numbers[first].astype(np.int32)

    def matrix(self, values: Array) -> Sparse:
        """The sum of blocks with values (n, r, c); columns of each row are in the order of the column blocks."""
        n, r, c = values.shape
        count = len(self._starts) - 1
        summed = np.zeros((count, r, c))
        entries = self._starts, self._order, np.ones(n)
        compiled.csr_matvecs(count, n, r * c, *entries, np.ascontiguousarray(values).ravel(), summed.ravel())
        width, row = np.diff(self._begins), self._row
        # row i of the k-th of m blocks of a row block whose first position is s has the line s r + i m + k
        line = (np.arange(count) + (r - 1) * self._begins[row])[:, None] + width[row][:, None] * np.arange(r)
        data, indices = np.empty((count * r, c)), np.empty((count * r, c), dtype=np.int32)
        data[line], indices[line] = summed, self._numbers[:, None]
        indptr = np.append(0, np.cumsum(np.repeat(c * width, r))).astype(np.int32)
        return Sparse(data.ravel(), indices.ravel(), indptr, (self._rows * r, self._columns))
