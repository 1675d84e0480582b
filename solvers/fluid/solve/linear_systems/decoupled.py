"""Matrices whose factors smooth flows with velocities of second degree: they lack some of the couplings."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc


def decoupled(matrix: PETSc.Mat, component: NDArray[np.int64]) -> PETSc.Mat:
    """The matrix without couplings between different components of the velocity (collective).

    component: component of each owned unknown; that of the pressure has the largest number. With these couplings, of
    the symmetric gradient and of div u div v, the block of the velocity is that of elasticity, whose incomplete factors
    break down in stretched cells. Without them it consists of Laplace operators and has a third of the entries.
    Zeros on the diagonal stay, which the pressure may have: factors need room for their pivots.
    """
    indptr, columns, values = matrix.getValuesCSR()
    of_row, of_column = _of_entries(matrix, component, indptr, columns)
    pressure = matrix.comm.tompi4py().allreduce(int(component.max(initial=0)), op=MPI.MAX)
    kept = (values != 0.0) & ((of_row == of_column) | (of_row == pressure) | (of_column == pressure))
    kept |= _on_diagonal(matrix, indptr, columns)
    return _selected(matrix, kept, indptr, columns, values)


def without(matrix: PETSc.Mat, marked: NDArray[np.bool_]) -> PETSc.Mat:
    """The matrix with rows and columns of the identity at marked owned unknowns (collective)."""
    indptr, columns, values = matrix.getValuesCSR()
    of_row, of_column = _of_entries(matrix, marked.astype(np.int64), indptr, columns)
    own = _on_diagonal(matrix, indptr, columns)
    return _selected(
        matrix, (of_row + of_column == 0) | own, indptr, columns, np.where(own & (of_row > 0), 1.0, values)
    )


def _on_diagonal(matrix: PETSc.Mat, indptr, columns) -> NDArray[np.bool_]:
    first, end = matrix.getOwnershipRange()
    return np.asarray(np.repeat(np.arange(first, end), np.diff(indptr)) == columns)


def _of_entries(matrix: PETSc.Mat, some: NDArray[np.int64], indptr, columns) -> tuple[NDArray, NDArray]:
    """Numbers of owned unknowns at the row and at the column of each entry (collective)."""
    return np.repeat(some, np.diff(indptr)), _at_columns(matrix, some, columns)


def _selected(matrix: PETSc.Mat, kept: NDArray[np.bool_], indptr, columns, values) -> PETSc.Mat:
    """The matrix of some of the entries (collective)."""
    ends = np.concatenate([[0], np.cumsum(kept)])[indptr].astype(PETSc.IntType)
    return PETSc.Mat().createAIJ(matrix.getSizes(), csr=(ends, columns[kept], values[kept]), comm=matrix.comm)


def _at_columns(matrix: PETSc.Mat, some: NDArray[np.int64], columns: NDArray[np.int32]) -> NDArray[np.int64]:
    """Numbers of unknowns at columns, from those of owned ones (collective)."""
    if matrix.comm.size == 1:
        return some[columns]
    numbers, position = np.unique(columns, return_inverse=True)
    everywhere = matrix.createVecRight()
    everywhere.array[:] = some
    here = PETSc.Vec().createSeq(len(numbers))
    chosen = PETSc.IS().createGeneral(numbers.astype(PETSc.IntType))
    scatter = PETSc.Scatter().create(everywhere, chosen, here, None)
    scatter.scatter(everywhere, here)
    return here.array.astype(np.int64)[position]
