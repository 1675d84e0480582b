"""Lagged preconditioners and factors: those of one matrix are reused for later matrices of the time step."""

from __future__ import annotations

import math

from petsc4py import PETSc

from solvers.algebra import linear


class Lagged:
    """Solves with the preconditioner of an earlier matrix of the step while it is good enough.

    The first `fresh` matrices of a step get their own preconditioners. The last of these is reused until a solve fails
    or takes more than `patience` times the iterations per digit that it took for its own matrix. A solve ends with
    `FEW` iterations more than that, which take the time of a new preconditioner. Nothing is kept from step to step, so
    that resumed runs give the same results.
    """

    def __init__(self, *, fresh: float = 1, patience: float = 2.0, few: int = 0):
        """few: see `linear.solve`."""
        self.fresh, self.patience, self.few = fresh, patience, few
        self.made = 0  #: count of preconditioners in this step
        self._kept: tuple[PETSc.KSP, PETSc.Mat, float] | None = None  # with its matrix and iterations per digit

    def begin_step(self) -> None:
        """Discard the preconditioner of the last step."""
        self.made, self._kept = 0, None

    def solve_again(self, matrix: PETSc.Mat, b: PETSc.Vec, x: PETSc.Vec, *, reduction: float = 0.0) -> int | None:
        """Solve matrix x = b with the kept preconditioner. Returns the iterations, or None: a new solver is needed."""
        kept, self._kept = self._kept, None
        if kept is None or self.made < self.fresh:
            return None
        ksp, made_of, first = kept
        most = ksp.getTolerances()[3]
        if self.patience < math.inf:
            ksp.setTolerances(max_it=min(most, math.ceil(self.patience * first * digits(ksp, reduction)) + linear.FEW))
        try:
            iterations, solved = linear.solve(ksp, matrix, b, x, made_of, reduction=reduction, few=self.few)
        except linear.LinearSolveFailed:
            return None
        finally:
            ksp.setTolerances(max_it=most)
        if iterations / digits(ksp, solved) <= self.patience * first:
            self._kept = kept
        return iterations

    def solve(
        self,
        ksp: PETSc.KSP,
        matrix: PETSc.Mat,
        b: PETSc.Vec,
        x: PETSc.Vec,
        entries: PETSc.Mat | None = None,
        *,
        reduction: float = 0.0,
    ) -> int:
        """Solve matrix x = b with a solver for this matrix, which is kept; iterations. Raises LinearSolveFailed.

        entries: the matrix with its entries, if `matrix` has products with vectors alone.
        """
        iterations, solved = linear.solve(ksp, matrix, b, x, entries, reduction=reduction, few=self.few)
        ksp.getPC().setReusePreconditioner(True)  # also when the matrix changes
        self.made += 1
        self._kept = ksp, entries or matrix, iterations / digits(ksp, solved)
        return iterations


def digits(ksp: PETSc.KSP, reduction: float) -> float:
    """By which a solver reduces a residual: the negative logarithm of the factor."""
    return -math.log10(max(ksp.getTolerances()[0], reduction))


class LaggedFactors:
    """Lagged LU factors by MUMPS, which pivots for velocity and pressure; reused for solves of up to 20 iterations.

    An iteration with them costs next to nothing: systems are solved to the end.
    """

    def __init__(self, comm, *, fresh: float):
        self._lagged, self._ksp = Lagged(fresh=fresh, patience=math.inf), linear.factored_solver(comm, iterations=20)

    @property
    def factored(self) -> int:
        """Count of factorisations in this step."""
        return self._lagged.made

    def begin_step(self) -> None:
        """Discard the factors of the last step."""
        self._lagged.begin_step()

    def solve(self, matrix: PETSc.Mat, b: PETSc.Vec, x: PETSc.Vec, entries: PETSc.Mat | None = None) -> int:
        """Solve matrix x = b. Returns the count of iterations. Raises LinearSolveFailed.

        entries: what to factor, if `matrix` has products with vectors alone.
        """
        iterations = self._lagged.solve_again(matrix, b, x)
        if iterations is not None:
            return iterations
        self._ksp.getPC().setReusePreconditioner(False)  # the order of elimination stays
        return self._lagged.solve(self._ksp, matrix, b, x, entries)
