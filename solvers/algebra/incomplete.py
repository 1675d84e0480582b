"""Incomplete factors without fill of a matrix of dense blocks, as a preconditioner of PETSc (`pc_type python`).

They take a fourth of PETSc's time to compute, and half of it to apply: `kernels.BlockFactors`.
"""

from __future__ import annotations

import math

from petsc4py import PETSc

from solvers import kernels
from solvers.algebra.linear import ZERO_PIVOT
from solvers.algebra.petsc_blocks import block_rows
from solvers.algebra.petsc_python import PythonContext


class Incomplete(PythonContext):
    """Factors of the matrix of one process; of a matrix of another type they are PETSc's."""

    def __init__(self) -> None:
        self._factors: kernels.BlockFactors | None = None
        self._other: PETSc.PC | None = None
        self._exists = True

    def setUp(self, preconditioner: PETSc.PC) -> None:
        matrix = preconditioner.getOperators()[1]
        rows = block_rows(matrix)
        if rows is None or rows.values.shape[1] not in (3, 4):
            self._other = self._other or _of_petsc(matrix)
            self._other.setOperators(matrix)
            self._other.setUp()
            return
        if self._factors is None:
            self._factors = kernels.BlockFactors(rows.start, rows.columns, rows.values.shape[1])
        self._exists = self._factors.update(rows.values)

    def apply(self, preconditioner: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        if self._factors is None:
            assert self._other is not None
            self._other.apply(b, x)
        elif self._exists:
            self._factors.solve(b.array_r, x.array)
        else:
            x.set(math.nan)  # a Krylov method stops at it, and the next solver of the sequence takes over


def _of_petsc(matrix: PETSc.Mat) -> PETSc.PC:
    preconditioner = PETSc.PC().create(matrix.comm)
    preconditioner.setType(PETSc.PC.Type.ILU)
    preconditioner.setFactorPivot(ZERO_PIVOT)
    return preconditioner
