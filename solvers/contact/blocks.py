"""Sparse matrices of small blocks, one for each node or multiplier."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.api import Array

#: A sparse matrix and the numbers of its rows and columns in a larger one.
Part = tuple[sp.csr_matrix, NDArray[np.int64], NDArray[np.int64]]


def expand(matrix: sp.csr_matrix, dim: int) -> sp.csr_matrix:
    """matrix (x) I: the same for every component of a vector."""
    matrix, axes = matrix.tocsr(), np.arange(dim)
    rows, columns = (dim * at[:, None] + axes for at in (row_numbers(matrix), matrix.indices))
    shape = dim * matrix.shape[0], dim * matrix.shape[1]
    return sp.csr_matrix((matrix.data.repeat(dim), (rows.ravel(), columns.ravel())), shape=shape)


def row_numbers(matrix: sp.csr_matrix) -> NDArray[np.int64]:
    """The row of each entry."""
    return np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))


def add_up(parts: Sequence[Part], shape: tuple[int, int]) -> sp.csr_matrix:
    """The sum of matrices whose rows and columns have other numbers in it: (matrix, rows, columns) each.

    All entries become one matrix at once: that of a small problem costs as much as all its numbers.
    """
    if not parts:
        return sp.csr_matrix(shape)
    data = np.concatenate([matrix.data for matrix, _, _ in parts])
    rows = np.concatenate([rows[row_numbers(matrix)] for matrix, rows, _ in parts])
    columns = np.concatenate([columns[matrix.indices] for matrix, _, columns in parts])
    return sp.csr_matrix((data, (rows, columns)), shape=shape)


def vstack(parts: Sequence[sp.csr_matrix]) -> sp.csr_matrix:
    """Matrices one below the other."""
    return parts[0] if len(parts) == 1 else sp.vstack(parts, format="csr")


def components(items: NDArray[np.int64], dim: int) -> NDArray[np.int64]:
    """dim * item + component, shape (dim * n,)."""
    return (dim * items[:, None] + np.arange(dim)).ravel()


def block_diagonal(blocks: Array) -> sp.csr_matrix:
    """Blocks of shape (m, rows, columns) along the diagonal."""
    m, rows, columns = blocks.shape
    return sp.bsr_matrix((blocks, np.arange(m), np.arange(m + 1)), shape=(m * rows, m * columns)).tocsr()


def scale_rows(matrix: sp.csr_matrix, factors: Array) -> sp.csr_matrix:
    """The rows times factors, shape (rows,)."""
    data = matrix.data * factors.repeat(np.diff(matrix.indptr))
    return sp.csr_matrix((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def block_columns(vectors: Array) -> sp.csr_matrix:
    """Vectors of shape (m, dim) as columns, one after and below the other, shape (dim * m, m)."""
    return block_diagonal(vectors[:, :, None])


def inverse(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """The inverse of a matrix that is block diagonal up to the order of its rows and columns.

    Coupled unknowns are found as connected parts of its graph; each part is inverted densely.
    """
    n = matrix.shape[0]
    if n == 0:
        return sp.csr_matrix((0, 0))
    _, part = sp.csgraph.connected_components(matrix, directed=False)
    order = np.argsort(part, kind="stable")
    sizes = np.bincount(part)
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    entries = matrix[order][:, order].tocoo()
    of_part = np.repeat(np.arange(len(sizes)), sizes)
    rows, columns, data = [], [], []
    for size in np.unique(sizes):
        chosen = np.flatnonzero(sizes == size)
        place = np.full(len(sizes), -1)
        place[chosen] = np.arange(len(chosen))
        mine = place[of_part[entries.row]] >= 0
        row, column = entries.row[mine], entries.col[mine]
        block = place[of_part[row]]
        dense = np.zeros((len(chosen), size, size))
        np.add.at(dense, (block, row - starts[of_part[row]], column - starts[of_part[column]]), entries.data[mine])
        places = starts[chosen][:, None] + np.arange(size)
        rows.append(np.repeat(places, size, axis=1).ravel())
        columns.append(np.tile(places, (1, size)).ravel())
        data.append(np.linalg.inv(dense).ravel())
    found = (np.concatenate(data), (order[np.concatenate(rows)], order[np.concatenate(columns)]))
    return sp.csr_matrix(found, shape=(n, n))
