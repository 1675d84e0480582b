"""LU factors that serve for several matrices of a time step."""

from __future__ import annotations

from petsc4py import PETSc

from solvers.linear import LinearSolveFailed, solve


class LaggedFactors:
    """LU by MUMPS (velocity and pressure need pivoting), later matrices of a step by GMRES with the factors there are.

    `fresh`: matrices of a step that are factored in any case, because those after them are far away. A matrix for which
    GMRES takes too long is factored too. Nothing is kept from step to step, so that resumed runs are the same.
    """

    def __init__(self, comm, *, fresh: float):
        self.fresh = fresh
        self.factored = 0  #: matrices of this step so far
        self._ksp = PETSc.KSP().create(comm)
        self._ksp.setType(PETSc.KSP.Type.GMRES)
        self._ksp.setPCSide(PETSc.PC.Side.RIGHT)
        self._ksp.setTolerances(rtol=1e-8, max_it=20)
        self._ksp.getPC().setType(PETSc.PC.Type.LU)
        self._ksp.getPC().setFactorSolverType("mumps")

    def begin_step(self) -> None:
        """The next matrix is one of another step."""
        self.factored = 0

    def solve(self, matrix: PETSc.Mat, b: PETSc.Vec, x: PETSc.Vec) -> int:
        """Solve matrix x = b; how many iterations that took. Raises LinearSolveFailed."""
        if self.factored >= self.fresh:
            self._ksp.getPC().setReusePreconditioner(True)
            try:
                solve(self._ksp, matrix, b, x)
            except LinearSolveFailed:
                pass
            else:
                return int(self._ksp.getIterationNumber())
        self._ksp.getPC().setReusePreconditioner(False)
        self.factored += 1
        solve(self._ksp, matrix, b, x)
        return int(self._ksp.getIterationNumber())
