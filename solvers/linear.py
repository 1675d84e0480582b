"""Linear solvers: a direct one for small systems, a preconditioned Krylov method above."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from petsc4py import PETSc

from solvers import unlocked

Method = Literal["auto", "direct", "iterative", "ilu"]

#: Unknowns above which the iterative solver is taken. Measured on one core (`make bench`): with hex8 it wins from 5,000
#: (compact bodies) or 25,000 (slender ones) on, with second order and thin cells only from 50,000; direct never fails.
DIRECT_LIMIT = {2: 400_000, 3: 30_000}


# Newer PETSc takes several dot products at once by BLAS, whose sums depend on where the vectors lie in memory. The same
# run would then end with other last digits each time, and a resumed run with others than an uninterrupted one.
for _option in ("vec_mdot_use_gemv", "vec_maxpy_use_gemv"):
    PETSc.Options()[_option] = False


class LinearSolveFailed(ArithmeticError):
    """The linear system has no usable solution: the matrix is singular, or the Krylov method stalled."""

    def __init__(self, message: str, *, singular: bool = False):
        super().__init__(message)
        self.singular = singular


def choose(method: Method, dim: int, dofs: int) -> Literal["direct", "iterative", "ilu"]:
    """The method for a system of this size."""
    if method == "auto":
        return "direct" if dofs <= DIRECT_LIMIT[dim] else "iterative"
    return method


#: (communicator, task) -> solver
Maker: TypeAlias = Callable[[Any, "Task"], PETSc.KSP]

#: Unknowns of a plane problem below which PETSc's own factorisation is as fast as MUMPS or up to 6 times faster, on one
#: process. Nested dissection: by bandwidth a slender body is 1.5 times faster, but a square one 5 times slower.
SMALL_PLANE = 4_000

#: Size of a pivot that PETSc takes for zero. Its own 2e-14 is one of numbers of size 1: in units where stiffness is
#: 1e-21, regular matrices were refused. Bodies without supports are found by how far they fly (`flown_off`).
ZERO_PIVOT = 1e-300


@dataclass(frozen=True)
class Task:
    """What a solver is for."""

    dim: int
    dofs: int  #: unknowns on all processes
    symmetric: bool
    tolerance: float  #: |b - A x| < tolerance |b|, of Krylov methods


def direct_solver(comm, task: Task) -> PETSc.KSP:
    """LDL^T of a symmetric matrix, LU otherwise: by PETSc for small plane problems on one process, by MUMPS above."""
    ksp = PETSc.KSP().create(comm)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    preconditioner = ksp.getPC()
    preconditioner.setType(PETSc.PC.Type.CHOLESKY if task.symmetric else PETSc.PC.Type.LU)
    if task.dim == 2 and task.dofs < SMALL_PLANE and comm.size == 1:
        preconditioner.setFactorOrdering("nd")
        preconditioner.setFactorPivot(ZERO_PIVOT)
    else:
        preconditioner.setFactorSolverType("mumps")
    return ksp


#: Smoothed aggregation with a polynomial smoother; SOR breaks down on coarse blocks with more modes than equations.
MULTIGRID = {
    "pc_type": "gamg",
    "pc_gamg_type": "agg",
    "pc_gamg_threshold": 0.04,
    "mg_levels_ksp_type": "chebyshev",
    "mg_levels_ksp_max_it": 2,
    "mg_levels_pc_type": "jacobi",
}


def elastic_solver(comm, task: Task) -> PETSc.KSP:
    """GMRES with algebraic multigrid until |b - A x| < tolerance |b|; the matrix carries the rigid-body modes.

    Not CG: an iterate of Newton's method that went too far may have an indefinite tangent.
    """
    ksp = PETSc.KSP().create(comm)
    ksp.setOptionsPrefix("elastic_")
    ksp.setType(PETSc.KSP.Type.GMRES)
    ksp.setPCSide(PETSc.PC.Side.RIGHT)
    ksp.setGMRESRestart(100)
    ksp.setTolerances(rtol=task.tolerance, max_it=500)
    return ksp


def _multigrid(comm) -> PETSc.PC:
    """A hierarchy for one matrix.

    An old one takes 3 times the iterations once bodies have turned (PETSc keeps the modes that it saw first), and a
    resumed run does not have it.
    """
    options = PETSc.Options("elastic_")
    for name, value in MULTIGRID.items():
        options[name] = value
    preconditioner = PETSc.PC().create(comm)
    preconditioner.setOptionsPrefix("elastic_")
    preconditioner.setFromOptions()
    return preconditioner


#: A solver of flows.
FlowMethod = Literal["multigrid", "ilu", "fill", "direct"]


def choose_flow(
    method: Method, dim: int, dofs: int, *, degree: int, steady: bool, multigrid: bool = True
) -> tuple[FlowMethod, ...]:
    """Solvers for a flow of this size from the usual one to the last resort, by the degree of its velocity.

    More fill takes minutes for velocities of second degree. multigrid: all cells are those of one lattice.
    """
    if method == "direct" or (method == "auto" and dofs <= FLOW_DIRECT_LIMIT[dim]):
        return ("direct",)
    if not multigrid:
        return ("ilu", "direct") if degree > 1 else ("ilu", "fill", "direct")
    if method == "ilu" or (method == "auto" and not steady and dofs <= FLOW_INCOMPLETE_LIMIT[degree]):
        return ("ilu", "multigrid", "direct")
    return ("multigrid", "direct") if degree > 1 else ("multigrid", "fill", "direct")


#: Unknowns of a flow above which the iterative solver is taken. Measured: in 3D it is 4 times faster at 8,000 already.
FLOW_DIRECT_LIMIT = {2: 400_000, 3: 4_000}

#: Unknowns of a flow in time above which multigrid takes less time than incomplete factors, by degree. Measured per
#: step, all included: `channel` takes as long with either at 98,000; q2q1 1.4 s instead of 2.8 s at 15,000, but 9.4 s
#: instead of 5.6 s at 49,000; `torus_wall` (16,200, coupled) 0.95 s instead of 1.5 s.
FLOW_INCOMPLETE_LIMIT = {1: 100_000, 2: 25_000}


def flow_solver(comm, *, tolerance: float, fill: bool = False) -> PETSc.KSP:
    """GMRES with overlapping subdomains and incomplete factors, velocity and pressure of a node side by side.

    fill: more of both, for systems on which the usual ones stall.
    """
    if fill:
        return _schwarz_solver(comm, "flow_fill_", tolerance, pc_asm_overlap=2, sub_pc_factor_levels=1)
    return _schwarz_solver(comm, "flow_", tolerance)


def flexible_solver(comm, *, tolerance: float) -> PETSc.KSP:
    """FGMRES for a preconditioner that may change from iteration to iteration."""
    ksp = PETSc.KSP().create(comm)
    ksp.setType(PETSc.KSP.Type.FGMRES)
    ksp.setGMRESRestart(100)
    ksp.setTolerances(rtol=tolerance, max_it=200)
    return ksp


def incomplete_solver(comm, task: Task) -> PETSc.KSP:
    """GMRES with overlapping subdomains and incomplete factors for solids: cheap, but stalls where multigrid does not.

    Measured with contact: 4 times faster than LU for bodies in motion and for compact ones (16 and 90 iterations), not
    faster for thin bodies at rest. Numbered along the band, it takes 2/3 of the iterations of the mesh's numbering.
    """
    return _schwarz_solver(comm, "incomplete_", task.tolerance, sub_pc_factor_mat_ordering_type="rcm")


#: Solvers for solids, by the names of methods; a field takes a function like these, too.
SOLVERS: Mapping[str, Maker] = {"direct": direct_solver, "iterative": elastic_solver, "ilu": incomplete_solver}


def _schwarz_solver(comm, prefix: str, tolerance: float, **more: str | float) -> PETSc.KSP:
    options = PETSc.Options(prefix)
    for name, value in _incomplete_factors(comm, **more).items():
        options[name] = value
    ksp = PETSc.KSP().create(comm)
    ksp.setOptionsPrefix(prefix)
    ksp.setType(PETSc.KSP.Type.GMRES)
    ksp.setPCSide(PETSc.PC.Side.RIGHT)
    ksp.setGMRESRestart(150)
    ksp.setTolerances(rtol=tolerance, max_it=600)
    ksp.setFromOptions()
    return ksp


def _incomplete_factors(comm, **more: str | float) -> dict[str, str | float]:
    """Options of overlapping subdomains; on one process without them, because the only one would copy the matrix."""
    given: dict[str, str | float] = {"sub_pc_type": "ilu", "sub_pc_factor_levels": 0, **more}
    given["sub_pc_factor_zeropivot"] = ZERO_PIVOT
    if comm.size > 1:
        return {"pc_type": "asm", "pc_asm_overlap": 1, **given}
    return {name.removeprefix("sub_"): value for name, value in given.items() if name.startswith("sub_")}


def coupled_solver(comm, structure, flow, *, tolerance: float, fill: bool = False) -> PETSc.KSP:
    """FGMRES for structure and flow together; `structure`, `flow`: their rows, as index sets.

    Preconditioner: block Gauss-Seidel, the structure by LU, then the flow by incomplete factors on overlapping parts
    (`fill`: more of both), unless its part, the second one, is set up otherwise.
    Source: Gee, Kuttler, Wall, Int. J. Numer. Meth. Engng 85 (2011) 987-1016.
    """
    more = {"pc_asm_overlap": 2, "sub_pc_factor_levels": 1} if fill else {}
    options = PETSc.Options("coupled_")
    for name, value in {
        "pc_fieldsplit_type": "multiplicative",
        "fieldsplit_structure_ksp_type": "preonly",
        "fieldsplit_structure_pc_type": "lu",
        "fieldsplit_structure_pc_factor_mat_solver_type": "mumps",
        "fieldsplit_flow_ksp_type": "preonly",
        **{f"fieldsplit_flow_{name}": value for name, value in _incomplete_factors(comm, **more).items()},
    }.items():
        options[name] = value
    ksp = PETSc.KSP().create(comm)
    ksp.setOptionsPrefix("coupled_")
    ksp.setType(PETSc.KSP.Type.FGMRES)
    ksp.setGMRESRestart(150)
    ksp.setTolerances(rtol=tolerance, max_it=600)
    ksp.getPC().setType(PETSc.PC.Type.FIELDSPLIT)
    ksp.getPC().setFieldSplitIS(("structure", structure), ("flow", flow))
    ksp.setFromOptions()
    return ksp


def factored_solver(comm, *, iterations: int) -> PETSc.KSP:
    """GMRES with LU factors by MUMPS, for their own matrix and for later ones."""
    ksp = PETSc.KSP().create(comm)
    ksp.setType(PETSc.KSP.Type.GMRES)
    ksp.setPCSide(PETSc.PC.Side.RIGHT)
    ksp.setTolerances(rtol=1e-8, max_it=iterations)
    ksp.getPC().setType(PETSc.PC.Type.LU)
    ksp.getPC().setFactorSolverType("mumps")
    return ksp


def keep_preconditioner(ksp: PETSc.KSP) -> None:
    """From now on a solver keeps its preconditioner although its matrix changes; a split one those of its blocks."""
    own = ksp.getPC()
    split = own.getType() == PETSc.PC.Type.FIELDSPLIT
    for preconditioner in [part.getPC() for part in own.getFieldSplitSubKSP()] if split else [own]:
        preconditioner.setReusePreconditioner(True)


def solve(
    ksp: PETSc.KSP, matrix: PETSc.Mat, b: PETSc.Vec, x: PETSc.Vec, preconditioned_by: PETSc.Mat | None = None
) -> None:
    """Solve matrix x = b with a freshly assembled matrix. Raises LinearSolveFailed.

    `preconditioned_by`: the matrix of an earlier solve whose preconditioner is to serve again.
    """
    if ksp.getOptionsPrefix() == "elastic_":
        ksp.setPC(_multigrid(ksp.comm))
    # PETSc frees what Python has dropped only where all processes ask for it, per communicator
    for comm in (ksp.comm, matrix.comm):
        PETSc.garbage_cleanup(comm)
    ksp.setOperators(matrix, preconditioned_by)
    unlocked.solve(ksp, b, x)
    reason = ksp.getConvergedReason()
    if reason < 0:
        failed = PETSc.KSP.ConvergedReason.DIVERGED_PCSETUP_FAILED
        if ksp.getType() == PETSc.KSP.Type.PREONLY or reason == failed:
            raise LinearSolveFailed("the linear system is singular: is a body not supported?", singular=True)
        raise LinearSolveFailed(
            f"the linear solver stalled after {ksp.getIterationNumber()} iterations (PETSc reason {reason})"
        )
