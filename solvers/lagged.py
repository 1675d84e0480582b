"""Preconditioners and factors that serve for several matrices of a time step."""

from __future__ import annotations

import math

from petsc4py import PETSc

from solvers import linear


class Lagged:
    """Solves with the preconditioner of an earlier matrix of the step, as long as that serves.

    The first `fresh` matrices of a step get one of their own in any case, because those after them are far away. Then
    the last one serves until a solve fails or takes `patience` times the iterations that it took with its own matrix.
    Nothing is kept from step to step, so that resumed runs are the same.
    """

    def __init__(self, *, fresh: float = 1, patience: float = 2.0):
        self.fresh, self.patience = fresh, patience
        self.made = 0  #: preconditioners of this step so far
        self._kept: tuple[PETSc.KSP, PETSc.Mat, int] | None = None  # with its matrix and iterations

    def begin_step(self) -> None:
        """The next matrix is one of another step."""
        self.made, self._kept = 0, None

    def solve_again(self, matrix: PETSc.Mat, b: PETSc.Vec, x: PETSc.Vec) -> int | None:
        """Solve matrix x = b; how many iterations that took, or None: it takes a solver for this matrix."""
        kept, self._kept = self._kept, None
        if kept is None or self.made < self.fresh:
            return None
        ksp, made_of, first = kept
        try:
            linear.solve(ksp, matrix, b, x, made_of)
        except linear.LinearSolveFailed:
            return None
        iterations = int(ksp.getIterationNumber())
        if iterations <= self.patience * first:
            self._kept = kept
        return iterations

    def solve(self, ksp: PETSc.KSP, matrix: PETSc.Mat, b: PETSc.Vec, x: PETSc.Vec) -> int:
        """The same with a solver for this matrix, which is kept. Raises LinearSolveFailed."""
        linear.solve(ksp, matrix, b, x)
        linear.keep_preconditioner(ksp)
        self.made += 1
        first = int(ksp.getIterationNumber())
        self._kept = ksp, matrix, first
        return first


class LaggedFactors:
    """The same with LU factors by MUMPS (velocity and pressure need pivoting), which serve for 20 iterations."""

    def __init__(self, comm, *, fresh: float):
        self._lagged, self._ksp = Lagged(fresh=fresh, patience=math.inf), linear.factored_solver(comm, iterations=20)

    @property
    def factored(self) -> int:
        """Matrices of this step so far."""
        return self._lagged.made

    def begin_step(self) -> None:
        """The next matrix is one of another step."""
        self._lagged.begin_step()

    def solve(self, matrix: PETSc.Mat, b: PETSc.Vec, x: PETSc.Vec) -> int:
        """Solve matrix x = b; how many iterations that took. Raises LinearSolveFailed."""
        iterations = self._lagged.solve_again(matrix, b, x)
        if iterations is not None:
            return iterations
        self._ksp.getPC().setReusePreconditioner(False)  # the order of elimination stays
        return self._lagged.solve(self._ksp, matrix, b, x)
