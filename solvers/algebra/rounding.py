"""Estimate of the rounding error of a residual, row by row, from the magnitudes of the terms of its sums.

A row is compared with its own error. With a norm over all rows, the errors of a stiff body or of a sliver cell would
pass for the solution of what is soft.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from solvers.algebra.petsc_blocks import BlockRows, block_rows, entry_rows
from solvers.algebra.rows import gather, owned_rows
from solvers.algebra.sparse import Sparse
from solvers.api import EPS, Array
from solvers.kernels import row_squares


def rounding_error(matrix: PETSc.Mat, values: Array) -> Array:
    """Rounding error of the sums A x by rows, shape (owned rows,), for owned values x (collective).

    The product a_ij x_j has an error of about eps |a_ij x_j| with a random sign, so that the error of row i is about
    eps (sum_j (a_ij x_j)^2)^(1/2).
    """
    if (rows := _rows(matrix)) is not None:
        squares = np.zeros(matrix.getLocalSize()[0])
        row_squares(rows.start, rows.columns, rows.values, np.ascontiguousarray(values), squares)
        return EPS * np.sqrt(squares)
    return rounding_error_of_rows(owned_rows(matrix), gather(matrix.comm.tompi4py(), values))


def rounding_error_of_rows(rows: Sparse, values: Array) -> Array:
    """The same for some rows and all values."""
    with np.errstate(over="ignore"):  # of an iterate that has blown up
        squares = Sparse(rows.data**2, rows.indices, rows.indptr, rows.shape) @ values**2
    return EPS * np.sqrt(squares)


def _rows(matrix: PETSc.Mat) -> BlockRows | None:
    """The rows of a matrix on one process, of blocks or of numbers."""
    if matrix.getType() == PETSc.Mat.Type.SEQAIJ:
        start, columns, values = entry_rows(matrix)
        return BlockRows(start, columns, values.reshape(-1, 1, 1))
    return block_rows(matrix)
