"""Linear solvers: a direct one for small systems, a preconditioned Krylov method above."""

from __future__ import annotations

from typing import Literal

from petsc4py import PETSc

Method = Literal["auto", "direct", "iterative"]

#: Unknowns above which the iterative solver is faster on one core (measured in `make bench`).
DIRECT_LIMIT = {2: 400_000, 3: 40_000}


class LinearSolveFailed(ArithmeticError):
    """The linear system has no usable solution (singular matrix, or the Krylov method stalled)."""


def choose(method: Method, dim: int, dofs: int) -> Literal["direct", "iterative"]:
    """The method for a system of this size."""
    if method == "auto":
        return "direct" if dofs <= DIRECT_LIMIT[dim] else "iterative"
    return method


#: Unknowns of a plane problem below which PETSc's own factorisation is 2 to 6 times faster than MUMPS on one process.
SMALL_PLANE = 5_000


def direct_solver(comm, *, dim: int, dofs: int, symmetric: bool) -> PETSc.KSP:
    """MUMPS (LDL^T of a symmetric matrix, LU otherwise); PETSc's LU for small plane problems on one process."""
    ksp = PETSc.KSP().create(comm)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    preconditioner = ksp.getPC()
    if dim == 2 and dofs < SMALL_PLANE and comm.size == 1:
        preconditioner.setType(PETSc.PC.Type.LU)
        preconditioner.setFactorOrdering("rcm")
        return ksp
    preconditioner.setType(PETSc.PC.Type.CHOLESKY if symmetric else PETSc.PC.Type.LU)
    preconditioner.setFactorSolverType("mumps")
    return ksp


def elastic_solver(comm, *, symmetric: bool, tolerance: float) -> PETSc.KSP:
    """Krylov method with smoothed-aggregation multigrid; the matrix carries the rigid-body modes."""
    ksp = PETSc.KSP().create(comm)
    ksp.setType(PETSc.KSP.Type.CG if symmetric else PETSc.KSP.Type.GMRES)
    ksp.setTolerances(rtol=tolerance, max_it=1000)
    ksp.getPC().setType(PETSc.PC.Type.GAMG)
    return ksp


def solve(ksp: PETSc.KSP, matrix: PETSc.Mat, b: PETSc.Vec, x: PETSc.Vec) -> None:
    """Solve matrix x = b with a freshly assembled matrix. Raises LinearSolveFailed."""
    ksp.setOperators(matrix)
    ksp.solve(b, x)
    reason = ksp.getConvergedReason()
    if reason < 0:
        raise LinearSolveFailed(
            "the linear system is singular: is a body not held?"
            if ksp.getType() == PETSc.KSP.Type.PREONLY
            else f"the linear solver stalled after {ksp.getIterationNumber()} iterations (PETSc reason {reason})"
        )
