"""Exact elimination of a few unknowns u of a coupled system, around a preconditioner P of all others.

    [ K  C ]     A X = D,  S = K - C X,    u = S^-1 (b_u - C P b),    the others: P b - X u
    [ D  A ]

With X and S the preconditioned matrix is [[1, 0], [0, A P]]: as many iterations as without these unknowns.

Unknowns that move whole surfaces, such as those of rigid bodies, couple to the whole flow. Diagonal blocks precondition
badly then, however good each of them is. The penalty of the surface is in K as well as in C X, and S is what remains:
drag, added mass and inertia, a twentieth of K for a ball in a tube. So P D in the place of X does not do.
Source: Benzi, Golub, Liesen, Acta Numerica 14 (2005) 1-137, section 5.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from solvers.algebra import unlocked
from solvers.algebra.gauss_seidel import TwoFields, matrix_of
from solvers.algebra.petsc_python import PythonContext
from solvers.api import Array, Indices

#: Reduction of the residual of each column of X. From 0.3 to 1e-5 two balls in a box take 50 or 51 iterations in 11
#: steps, 195 without elimination. Where S is a twentieth of K, its error is below a fifth with this.
COLUMN_REDUCTION = 1e-2

#: Iterations for a column at most; X is then as good as it gets, and the outer method decides.
COLUMN_ITERATIONS = 30


class FewUnknowns(PythonContext):
    """Context of a preconditioner of `TwoFields`; others: that of the system in which the few are held at zero."""

    def __init__(self, few: Indices, others: PETSc.PC):
        """few: numbers of these unknowns among those of the first field, the same on all processes."""
        self._few, self._others = few, others
        self._fields: TwoFields | None = None
        self._own = self._at = few  # numbers of the owned ones among the owned unknowns, and among the few
        self._moved = self._inverse = np.empty((0, 0))  # X at owned unknowns, S^-1

    def setUp(self, preconditioner: PETSc.PC) -> None:
        """Set up the preconditioner of the others, and solve for each column of X with it (collective)."""
        fields = self._fields = preconditioner.getOperators()[1].getPythonContext()
        (A11, A12), (A21, A22) = fields.blocks
        start, end = A11.getOwnershipRange()
        self._at = np.flatnonzero((self._few >= start) & (self._few < end))
        self._own = self._few[self._at] - start
        held, into = self._without(A11, 1.0), self._without(A12, 0.0)
        rest = matrix_of(replace(fields, blocks=((held, into), (A21, A22)), product=None))
        self._others.setOperators(rest)
        self._others.setUp()
        self._others.setReusePreconditioner(True)  # also when the matrix changes, until this is set up again
        columns = self._column_solver(rest)
        right = PETSc.Vec().createMPI((A11.getLocalSize()[0] + A22.getLocalSize()[0], None), comm=rest.comm)
        found = right.duplicate()
        unit = A11.createVecs()[0]
        self._moved = np.zeros((right.local_size, len(self._few)))
        schur = np.empty((len(self._few), len(self._few)))
        for column in range(len(self._few)):
            unit.set(0.0)
            unit.array[self._own[self._at == column]] = 1.0
            with fields.parts(right) as (first, second):
                A11.mult(unit, first)
                A21.mult(unit, second)
                own = self._gather(first)
                first.array[self._own] = 0.0
            unlocked.solve(columns, right, found)
            self._moved[:, column] = found.array_r
            schur[:, column] = own - self._rows(found)
        try:
            self._inverse = np.linalg.inv(schur)
        except np.linalg.LinAlgError:
            self._inverse = np.full_like(schur, np.nan)  # the outer method stops at it

    def _without(self, matrix: PETSc.Mat, diagonal: float) -> PETSc.Mat:
        """A copy with nothing but a diagonal in the rows of the few unknowns (collective)."""
        found = matrix.duplicate(copy=True)
        found.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        found.zeroRows((matrix.getOwnershipRange()[0] + self._own).astype(PETSc.IntType), diagonal)
        return found

    def _column_solver(self, rest: PETSc.Mat) -> PETSc.KSP:
        ksp = PETSc.KSP().create(rest.comm)
        ksp.setType(PETSc.KSP.Type.FGMRES)
        ksp.setGMRESRestart(COLUMN_ITERATIONS)
        ksp.setTolerances(rtol=COLUMN_REDUCTION, max_it=COLUMN_ITERATIONS)
        ksp.setPC(self._others)
        ksp.setOperators(rest)
        return ksp

    def _rows(self, x: PETSc.Vec) -> Array:
        """C x (collective)."""
        assert self._fields is not None
        (A11, A12), _ = self._fields.blocks
        with self._fields.parts(x) as (first, second):
            rows = A11.createVecs()[1]
            A11.mult(first, rows)
            A12.multAdd(second, rows, rows)
        return self._gather(rows)

    def _gather(self, first: PETSc.Vec) -> Array:
        """Values of the few unknowns on every process (collective)."""
        found = np.zeros(len(self._few))
        found[self._at] = first.array_r[self._own]
        comm = first.comm.tompi4py()
        return found if comm.size == 1 else comm.allreduce(found)

    def apply(self, preconditioner: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        assert self._fields is not None
        right = x.copy()
        with self._fields.parts(right) as (first, _):
            given = self._gather(first)
            first.array[self._own] = 0.0
        self._others.apply(right, y)
        few = self._inverse @ (given - self._rows(y))
        y.array[:] -= self._moved @ few
        with self._fields.parts(y) as (first, _):
            first.array[self._own] = few[self._at]
