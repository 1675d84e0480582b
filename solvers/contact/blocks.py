"""Sparse matrices of small blocks, one for each node or multiplier."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.connected import connected_parts
from solvers.algebra.sparse import Sparse, nothing, sparse_from_entries
from solvers.api import Array

#: A sparse matrix and the numbers of its rows and columns in a larger one.
Part = tuple[Sparse, NDArray[np.int64], NDArray[np.int64]]


def expand(matrix: Sparse, dim: int) -> Sparse:
    """The Kronecker product matrix (x) I, which applies the matrix to every component of a vector."""
    rows, columns = matrix.shape
    repeated = matrix[np.repeat(np.arange(rows), dim)]
    indices = dim * repeated.indices + repeated.row_numbers() % dim
    return Sparse(repeated.data, indices, repeated.indptr, (dim * rows, dim * columns))


def add_up(parts: Sequence[Part], shape: tuple[int, int]) -> Sparse:
    """The sum of matrices, each with the numbers of its rows and columns in the sum."""
    if not parts:
        return nothing(shape)
    if len(parts) == 1 and all(_once(numbers) for numbers in parts[0][1:]):
        matrix, rows, columns = parts[0]
        return matrix.with_columns(columns, shape[1]).with_rows(rows, shape[0]).ordered()
    data = np.concatenate([matrix.data for matrix, _, _ in parts])
    rows = np.concatenate([rows[matrix.row_numbers()] for matrix, rows, _ in parts])
    columns = np.concatenate([columns[matrix.indices] for matrix, _, columns in parts])
    return sparse_from_entries(rows, columns, data, shape)


def _once(numbers: NDArray[np.int64]) -> bool:
    return bool(np.bincount(numbers).max(initial=0) <= 1)


def components(items: NDArray[np.int64], dim: int) -> NDArray[np.int64]:
    """Numbers dim * item + component of all components, shape (dim * n,)."""
    return (dim * items[:, None] + np.arange(dim)).ravel()


def block_diagonal(blocks: Array) -> Sparse:
    """The block diagonal matrix of blocks of shape (m, rows, columns)."""
    m, rows, columns = blocks.shape
    numbers = np.arange(m * columns, dtype=np.int32).reshape(m, 1, columns)
    indptr = np.arange(0, m * rows * columns + 1, columns, dtype=np.int32)
    return Sparse(blocks.ravel(), np.broadcast_to(numbers, blocks.shape).ravel(), indptr, (m * rows, m * columns))


def inverse(matrix: Sparse) -> Sparse:
    """The inverse of a matrix that is block diagonal up to the order of its rows and columns.

    Blocks are the connected parts of its graph. Each is inverted as a dense matrix.
    """
    n = matrix.shape[0]
    row, column = matrix.row_numbers(), matrix.indices
    part = connected_parts(row, column, n)
    order = np.argsort(part, kind="stable")
    sizes = np.bincount(part, minlength=n)
    starts = np.cumsum(sizes) - sizes
    at = np.empty(n, dtype=np.int64)  # index within the part
    at[order] = np.arange(n) - starts[part[order]]
    rows, columns, data = [], [], []
    for size in np.unique(sizes[sizes > 0]):
        chosen = np.flatnonzero(sizes == size)
        block = np.full(n, -1)
        block[chosen] = np.arange(len(chosen))
        mine = block[part[row]] >= 0
        dense = np.zeros((len(chosen), size, size))
        dense[block[part[row[mine]]], at[row[mine]], at[column[mine]]] = matrix.data[mine]
        members = order[starts[chosen][:, None] + np.arange(size)]
        rows.append(np.repeat(members, size, axis=1).ravel())
        columns.append(np.tile(members, (1, size)).ravel())
        data.append(np.linalg.inv(dense).ravel())
    if not data:
        return nothing((0, 0))
    return sparse_from_entries(np.concatenate(rows), np.concatenate(columns), np.concatenate(data), (n, n))
