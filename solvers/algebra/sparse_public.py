"""The routines of `solvers.algebra.sparse` by scipy's public classes, for a scipy without the private ones.

Arguments are those of the routines of the same name: a matrix is (indptr, indices, data); the last arrays are filled.
The numbers are the same, the cost per call is ten times as much.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from solvers.api import Array


def csr_matmat_maxnnz(rows: int, columns: int, p, j, q, k) -> int:
    """Entries of a product."""
    found = _matrix(rows, len(q) - 1, p, j, np.ones(len(j))) @ _matrix(len(q) - 1, columns, q, k, np.ones(len(k)))
    return found.nnz


def csr_matmat(rows: int, columns: int, p, j, x, q, k, y, indptr, indices, data) -> None:
    """Product of two matrices."""
    inner = len(q) - 1
    _put(_matrix(rows, inner, p, j, x) @ _matrix(inner, columns, q, k, y), indptr, indices, data)


def csr_matvec(rows: int, columns: int, p, j, x, vector: Array, out: Array) -> None:
    """Product with a vector, added to what is there."""
    out += _matrix(rows, columns, p, j, x) @ vector


def csr_matvecs(rows: int, columns: int, count: int, p, j, x, vectors: Array, out: Array) -> None:
    """Product with several vectors side by side, added to what is there."""
    out += (_matrix(rows, columns, p, j, x) @ vectors.reshape(columns, count)).ravel()


def csr_plus_csr(rows: int, columns: int, p, j, x, q, k, y, indptr, indices, data) -> None:
    """Sum of two matrices."""
    _put(_matrix(rows, columns, p, j, x) + _matrix(rows, columns, q, k, y), indptr, indices, data)


def csr_minus_csr(rows: int, columns: int, p, j, x, q, k, y, indptr, indices, data) -> None:
    """Difference of two matrices."""
    _put(_matrix(rows, columns, p, j, x) - _matrix(rows, columns, q, k, y), indptr, indices, data)


def csr_row_index(count: int, chosen, p, j, x, indices, data) -> None:
    """Some rows, one after the other."""
    at = np.concatenate([np.arange(p[row], p[row + 1]) for row in chosen] or [np.zeros(0, dtype=int)])
    indices[:], data[:] = j[at], x[at]


def csr_tocsc(rows: int, columns: int, p, j, x, indptr, indices, data) -> None:
    """The matrix in compressed columns."""
    _put(_matrix(rows, columns, p, j, x).tocsc(), indptr, indices, data)


def csr_has_sorted_indices(rows: int, p, j) -> bool:
    """Are the columns of each row in order?"""
    return all((np.diff(j[p[row] : p[row + 1]]) >= 0).all() for row in range(rows))


def csr_sort_indices(rows: int, p, j, x) -> None:
    """Puts the columns of each row in order."""
    row = np.repeat(np.arange(rows), np.diff(p))
    order = np.lexsort((j[: len(row)], row))
    j[: len(row)], x[: len(row)] = j[order], x[order]


def csr_sum_duplicates(rows: int, columns: int, p, j, x) -> None:
    """Adds up entries of one row and column, whose columns are in order."""
    found = _matrix(rows, columns, p.copy(), j.copy(), x.copy())
    found.sum_duplicates()
    _put(found, p, j, x)


def csr_todense(rows: int, columns: int, p, j, x, out: Array) -> None:
    """Adds the entries to a full array."""
    out += _matrix(rows, columns, p, j, x).toarray()


def coo_tocsr(rows: int, columns: int, count: int, row, column, x, indptr, indices, data) -> None:
    """Rows of entries that are in any order; those of one row and column stay apart."""
    order = np.argsort(row, kind="stable")
    indptr[:] = np.searchsorted(row[order], np.arange(rows + 1))
    indices[:], data[:] = column[order], x[order]


def _matrix(rows: int, columns: int, indptr, indices, data) -> sp.csr_matrix:
    return sp.csr_matrix((data, indices, indptr), shape=(rows, columns))


def _put(found, indptr, indices, data) -> None:
    used = found.nnz
    indptr[:], indices[:used], data[:used] = found.indptr, found.indices, found.data
