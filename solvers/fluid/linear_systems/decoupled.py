"""The matrix whose incomplete factors precondition flows with velocities of second degree."""

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
    """
    indptr, columns, values = matrix.getValuesCSR()
    of_row, of_column = np.repeat(component, np.diff(indptr)), _at_columns(matrix, component, columns)
    pressure = matrix.comm.tompi4py().allreduce(int(component.max(initial=0)), op=MPI.MAX)
    kept = (of_row == of_column) | (of_row == pressure) | (of_column == pressure)
    ends = np.concatenate([[0], np.cumsum(kept)])[indptr].astype(PETSc.IntType)
    return PETSc.Mat().createAIJ(matrix.getSizes(), csr=(ends, columns[kept], values[kept]), comm=matrix.comm)


def _at_columns(matrix: PETSc.Mat, component: NDArray[np.int64], columns: NDArray[np.int32]) -> NDArray[np.int64]:
    """Components of unknowns by their global numbers (collective)."""
    if matrix.comm.size == 1:
        return component[columns]
    numbers, position = np.unique(columns, return_inverse=True)
    everywhere = matrix.createVecRight()
    everywhere.array[:] = component
    here = PETSc.Vec().createSeq(len(numbers))
    some = PETSc.IS().createGeneral(numbers.astype(PETSc.IntType))
    scatter = PETSc.Scatter().create(everywhere, some, here, None)
    scatter.scatter(everywhere, here)
    return here.array.astype(np.int64)[position]
