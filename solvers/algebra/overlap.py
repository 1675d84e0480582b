"""Sparse matrices from sums of small dense blocks that are combinations of given ones, added up where they coincide.

One sparse product computes all sums: rows are the positions of blocks, columns the given blocks.
"""

from __future__ import annotations

import numpy as np

from solvers.algebra.sparse import Sparse, counted_order
from solvers.api import Array, Indices32


class OverlappingBlocks:
    """Blocks of r rows and c columns: block i is the sum over f of weights[i, f] times the given block (sources[i], f).

    Block i is in row block rows[i] and column block columns[i]. Row block a has the rows a r ... a r + r - 1. The
    columns of column block b are numbers[i] of any i with columns[i] = b. Blocks at the same position add up.
    """

    def __init__(
        self,
        rows: Indices32,
        columns: Indices32,
        numbers: Indices32,
        weights: Array,
        sources: Indices32,
        shape: tuple[int, int],
        scalars: int,
    ):
        """rows, columns, sources: shape (n,); numbers: (n, c); weights: (n, factors).

        shape: counts of row and column blocks; scalars: columns.
        """
        self._rows, self._columns = shape[0], scalars
        order = counted_order(columns, shape[1])
        order = order[counted_order(rows[order], shape[0])]
        row, column = rows[order], columns[order]
        new = np.ones(len(order), dtype=bool)
        new[1:] = (row[1:] != row[:-1]) | (column[1:] != column[:-1])
        starts = np.flatnonzero(new)
        #: row block of each position, and the first position of each row block
        self._row, self._begins = row[starts], np.searchsorted(row[starts], np.arange(shape[0] + 1))
        self._numbers, self._order, self._ends = numbers[order[starts]], order, np.append(starts, len(order))
        factors = weights.shape[1]
        given = sources[order, None] * np.int32(factors) + np.arange(factors, dtype=np.int32)
        ends = (self._ends * factors).astype(np.int32)
        size = (int(sources.max(initial=-1)) + 1) * factors
        self._combination = Sparse(weights[order].ravel(), given.ravel(), ends, (len(starts), size))

    def matrix(self, given: Array, more: Array | None = None) -> Sparse:
        """The sum of all blocks, each row in the order of column blocks.

        given: (sources, factors, r, c); more: added to each block, (n, r, c).
        """
        *_, r, c = given.shape
        count, size = self._combination.shape
        summed = (self._combination @ given.reshape(-1, r * c)[:size]).reshape(count, r, c)
        if more is not None:
            n = len(more)
            each = Sparse(np.ones(n), self._order, self._ends.astype(np.int32), (count, n))
            summed += (each @ more.reshape(n, r * c)).reshape(count, r, c)
        width, row = np.diff(self._begins), self._row
        # row i of the k-th of m blocks of a row block whose first position is s has the line s r + i m + k
        line = (np.arange(count) + (r - 1) * self._begins[row])[:, None] + width[row][:, None] * np.arange(r)
        data, indices = np.empty((count * r, c)), np.empty((count * r, c), dtype=np.int32)
        data[line], indices[line] = summed, self._numbers[:, None]
        indptr = np.append(0, np.cumsum(np.repeat(c * width, r))).astype(np.int32)
        return Sparse(data.ravel(), indices.ravel(), indptr, (self._rows * r, self._columns))
