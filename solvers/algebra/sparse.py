"""Sparse matrices in compressed rows, with the operations that contact and coupling need.

Sums and products are compiled routines of scipy, called without its classes. Their checks of arguments and results take
20 to 100 microseconds per matrix, ten times the time of the operation on a small interface, and contact creates a
hundred matrices in a Newton iteration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices32

try:
    from scipy.sparse import _sparsetools as compiled  # private, but unchanged since scipy 0.14
except ImportError:
    from solvers.algebra import sparse_public as compiled


@dataclass(frozen=True, eq=False)
class Sparse:
    """A matrix in compressed rows: row i has data[k] in the columns indices[k], k = indptr[i] ... indptr[i + 1] - 1.

    Each column occurs once per row. Arrays are contiguous and never changed in place.
    """

    data: Array
    indices: Indices32
    indptr: Indices32
    shape: tuple[int, int]

    def __matmul__(self, other):
        """Product with a matrix, a vector, or an array whose columns are vectors."""
        if not isinstance(other, Sparse):
            return self._times(other)
        (rows, inner), columns = self.shape, other.shape[1]
        if inner != other.shape[0]:
            raise ValueError(f"shapes do not fit: {self.shape} @ {other.shape}")
        left, right = (self.indptr, self.indices), (other.indptr, other.indices)
        capacity = compiled.csr_matmat_maxnnz(rows, columns, *left, *right)
        data, indices, indptr = _empty(rows, capacity)
        compiled.csr_matmat(rows, columns, *left, self.data, *right, other.data, indptr, indices, data)
        return _trimmed(data, indices, indptr, (rows, columns))

    def _times(self, values: Array) -> Array:
        if values.shape[0] != self.shape[1]:
            raise ValueError(f"shapes do not fit: {self.shape} @ {values.shape}")
        values = np.ascontiguousarray(values, dtype=float)
        out = np.zeros((self.shape[0], *values.shape[1:]))
        entries = self.indptr, self.indices, self.data
        if values.ndim == 1:
            compiled.csr_matvec(*self.shape, *entries, values, out)
        else:
            compiled.csr_matvecs(*self.shape, values.shape[1], *entries, values.ravel(), out.ravel())
        return out

    def __add__(self, other: Sparse) -> Sparse:
        return self._combined(other, compiled.csr_plus_csr)

    def __sub__(self, other: Sparse) -> Sparse:
        return self._combined(other, compiled.csr_minus_csr)

    def _combined(self, other: Sparse, operation) -> Sparse:
        if self.shape != other.shape:
            raise ValueError(f"shapes do not fit: {self.shape}, {other.shape}")
        data, indices, indptr = _empty(self.shape[0], len(self.data) + len(other.data))
        entries = (part for matrix in (self, other) for part in (matrix.indptr, matrix.indices, matrix.data))
        operation(*self.shape, *entries, indptr, indices, data)
        return _trimmed(data, indices, indptr, self.shape)

    def __mul__(self, factor: float) -> Sparse:
        return Sparse(factor * self.data, self.indices, self.indptr, self.shape)

    __rmul__ = __mul__

    def __neg__(self) -> Sparse:
        return Sparse(-self.data, self.indices, self.indptr, self.shape)

    def __getitem__(self, rows: NDArray) -> Sparse:
        """Selected rows, by numbers or by a mask."""
        if rows.dtype == bool:
            rows = np.flatnonzero(rows)
        chosen = np.ascontiguousarray(rows, dtype=np.int32)
        indptr = np.zeros(len(chosen) + 1, dtype=np.int32)
        np.cumsum(self.indptr[chosen + 1] - self.indptr[chosen], out=indptr[1:])
        data, indices, _ = _empty(0, int(indptr[-1]))
        compiled.csr_row_index(len(chosen), chosen, self.indptr, self.indices, self.data, indices, data)
        return Sparse(data, indices, indptr, (len(chosen), self.shape[1]))

    @property
    def T(self) -> Sparse:
        """The transposed matrix, with ordered columns."""
        rows, columns = self.shape
        data, indices, indptr = _empty(columns, len(self.data))
        compiled.csr_tocsc(rows, columns, self.indptr, self.indices, self.data, indptr, indices, data)
        return Sparse(data, indices, indptr, (columns, rows))

    def row_numbers(self) -> Indices32:
        """The row of each entry."""
        return np.repeat(np.arange(self.shape[0], dtype=np.int32), self.indptr[1:] - self.indptr[:-1])

    def padded_rows(self) -> tuple[Indices32, Array]:
        """(columns, entries) of all rows, of shape (rows, largest count of a row); behind them zeros in column 0."""
        counts = self.indptr[1:] - self.indptr[:-1]
        width = int(counts.max(initial=0))
        columns, entries = np.zeros((len(counts), width), dtype=np.int32), np.zeros((len(counts), width))
        there = np.arange(width) < counts[:, None]
        columns[there], entries[there] = self.indices, self.data
        return columns, entries

    def with_columns(self, numbers: NDArray[np.int64], columns: int) -> Sparse:
        """Column j becomes column numbers[j] of `columns`, or is removed where that is -1."""
        target = numbers[self.indices]
        keep = target >= 0
        if keep.all():
            return Sparse(self.data, target.astype(np.int32), self.indptr, (self.shape[0], columns))
        before = np.zeros(len(keep) + 1, dtype=np.int32)
        np.cumsum(keep, out=before[1:])
        return Sparse(self.data[keep], target[keep].astype(np.int32), before[self.indptr], (self.shape[0], columns))

    def columns(self, which: NDArray[np.int64]) -> Sparse:
        """Selected columns, each at most once."""
        numbers = np.full(self.shape[1], -1)
        numbers[which] = np.arange(len(which))
        return self.with_columns(numbers, len(which))

    def with_rows(self, numbers: NDArray[np.int64], rows: int) -> Sparse:
        """Row i becomes row numbers[i] of `rows`; other rows are empty. Each number occurs once."""
        row = np.full(rows, -1, dtype=np.int64)
        row[numbers] = np.arange(self.shape[0])
        return _with_empty_row(self)[np.where(row < 0, self.shape[0], row)]

    def scaled_rows(self, factors: Array) -> Sparse:
        """Rows multiplied by factors, shape (rows,)."""
        data = self.data * np.repeat(factors, self.indptr[1:] - self.indptr[:-1])
        return Sparse(data, self.indices, self.indptr, self.shape)

    def ordered(self) -> Sparse:
        """The matrix with ordered columns in each row."""
        if compiled.csr_has_sorted_indices(self.shape[0], self.indptr, self.indices):
            return self
        data, indices = self.data.copy(), self.indices.copy()
        compiled.csr_sort_indices(self.shape[0], self.indptr, indices, data)
        return Sparse(data, indices, self.indptr, self.shape)

    def without_small(self, limit: float) -> Sparse:
        """The matrix without entries of magnitude up to `limit`."""
        keep = np.abs(self.data) > limit
        before = np.zeros(len(keep) + 1, dtype=np.int32)
        np.cumsum(keep, out=before[1:])
        return Sparse(self.data[keep], self.indices[keep], before[self.indptr], self.shape)

    def toarray(self) -> Array:
        """The matrix as a dense array."""
        out = np.zeros(self.shape)
        compiled.csr_todense(*self.shape, self.indptr, self.indices, self.data, out)
        return out


def sparse(csr, shape: tuple[int, int]) -> Sparse:
    """A matrix from (data, indices, indptr) of the kernels, or from a matrix of scipy."""
    data, indices, indptr = csr if isinstance(csr, tuple) else (csr.data, csr.indices, csr.indptr)
    indices, indptr = (np.ascontiguousarray(part, dtype=np.int32) for part in (indices, indptr))
    return Sparse(np.ascontiguousarray(data, dtype=float), indices, indptr, shape)


def sparse_from_entries(rows: NDArray, columns: NDArray, data: Array, shape: tuple[int, int]) -> Sparse:
    """A matrix from entries, with ordered columns; entries of the same row and column add up."""
    rows, columns = (np.ascontiguousarray(part, dtype=np.int32) for part in (rows, columns))
    out, indices, indptr = _empty(shape[0], len(data))
    compiled.coo_tocsr(*shape, len(data), rows, columns, np.ascontiguousarray(data), indptr, indices, out)
    compiled.csr_sort_indices(shape[0], indptr, indices, out)
    compiled.csr_sum_duplicates(*shape, indptr, indices, out)
    return _trimmed(out, indices, indptr, shape)


def counted_order(keys: Indices32, below: int) -> Indices32:
    """The stable order of keys, 0 <= key < below, by counting."""
    n, (unused, order, starts) = len(keys), _empty(below, len(keys))
    compiled.coo_tocsr(below, n, n, keys, np.arange(n, dtype=np.int32), np.empty(n), starts, order, unused)
    return order


def sparse_from_array(values: Array) -> Sparse:
    """A matrix with all entries of a dense array, zeros included."""
    rows, columns = values.shape
    indices = np.tile(np.arange(columns, dtype=np.int32), rows)
    indptr = np.arange(rows + 1, dtype=np.int32) * np.int32(columns)
    return Sparse(values.ravel(), indices, indptr, (rows, columns))


def nothing(shape: tuple[int, int]) -> Sparse:
    """A matrix without entries."""
    return Sparse(*_empty(0, 0)[:2], np.zeros(shape[0] + 1, dtype=np.int32), shape)


def diagonal(values: Array) -> Sparse:
    """A diagonal matrix."""
    n = len(values)
    return Sparse(values, np.arange(n, dtype=np.int32), np.arange(n + 1, dtype=np.int32), (n, n))


def block_diagonal(blocks: Array) -> Sparse:
    """A matrix with square blocks (count, n, n) on its diagonal."""
    count, n, _ = blocks.shape
    indices = np.repeat(np.arange(count * n, dtype=np.int32).reshape(count, 1, n), n, axis=1).ravel()
    return Sparse(blocks.ravel(), indices, np.arange(count * n + 1, dtype=np.int32) * np.int32(n), (count * n,) * 2)


def stack(parts: list[Sparse]) -> Sparse:
    """Matrices stacked vertically."""
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0] + [len(part.data) for part in parts])
    indptr = [part.indptr[1:] + np.int32(start) for part, start in zip(parts, starts, strict=False)]
    return Sparse(
        np.concatenate([part.data for part in parts]),
        np.concatenate([part.indices for part in parts]),
        np.concatenate([np.zeros(1, dtype=np.int32), *indptr]),
        (sum(part.shape[0] for part in parts), parts[0].shape[1]),
    )


def _with_empty_row(matrix: Sparse) -> Sparse:
    indptr = np.append(matrix.indptr, matrix.indptr[-1])
    return Sparse(matrix.data, matrix.indices, indptr, (matrix.shape[0] + 1, matrix.shape[1]))


def _empty(rows: int, entries: int) -> tuple[Array, Indices32, Indices32]:
    return np.empty(entries), np.empty(entries, dtype=np.int32), np.empty(rows + 1, dtype=np.int32)


def _trimmed(data: Array, indices: Indices32, indptr: Indices32, shape: tuple[int, int]) -> Sparse:
    """A matrix with arrays cut to the count of entries."""
    used = int(indptr[-1])
    return Sparse(data[:used], indices[:used], indptr, shape)
