"""Smoother of multigrid for velocities of second degree: exact factors near surfaces, incomplete ones elsewhere.

    x = F r,    x += R^T (R D R^T)^-1 R (r - D x),

D: the matrix of the smoother, R: the unknowns of cut cells and of the cells around them, F: incomplete factors of D
without the couplings of these (docs/theory_fluid.md, Smoother of q2q1). With cut cells alone in R, small steps take up
to six times the iterations.
Source: Saad, Iterative Methods for Sparse Linear Systems (2003), section 14.3 (the multiplicative Schwarz method).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.petsc_python import PythonContext
from solvers.fluid.solve.linear_systems.decoupled import without


class NearSmoother(PythonContext):
    """Context of a preconditioner. R has the unknowns near surfaces of all processes, of which there are some."""

    def __init__(self, incomplete: PETSc.PC, near: NDArray[np.bool_]):
        """incomplete: its operators are set here; near: owned unknowns near surfaces."""
        self._incomplete, self._near = incomplete, near
        self._numbers = np.flatnonzero(near)
        self._exact = PETSc.PC().create(incomplete.comm)
        self._exact.setType(PETSc.PC.Type.LU)
        self._exact.setFactorSolverType("mumps")
        #: matrix of the smoother, its residual, right-hand side and solution near surfaces; made in `setUp`
        self._matrix: PETSc.Mat = PETSc.Mat()
        self._residual, self._right, self._found = PETSc.Vec(), PETSc.Vec(), PETSc.Vec()

    def setUp(self, preconditioner: PETSc.PC) -> None:
        self._matrix = matrix = preconditioner.getOperators()[1]
        self._incomplete.setOperators(without(matrix, self._near))
        self._incomplete.setUp()
        self._residual = matrix.createVecLeft()
        rows = (matrix.getOwnershipRange()[0] + self._numbers).astype(PETSc.IntType)
        part = matrix.createSubMatrix(some := PETSc.IS().createGeneral(rows, comm=matrix.comm), some)
        self._right, self._found = part.createVecs()
        self._exact.setOperators(part)
        self._exact.setUp()

    def apply(self, preconditioner: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        self._incomplete.apply(b, x)
        self._matrix.mult(x, self._residual)
        self._right.array[:] = (b.array_r - self._residual.array_r)[self._numbers]
        self._exact.apply(self._right, self._found)
        x.array[self._numbers] += self._found.array_r
