"""Linear solvers: direct ones for small systems, preconditioned Krylov methods for large ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal, TypeAlias

import numpy as np
from petsc4py import PETSc

from solvers.algebra import unlocked
from solvers.algebra.few_unknowns import FewUnknowns
from solvers.algebra.gauss_seidel import GaussSeidel
from solvers.algebra.petsc_python import PythonContext, free_deleted
from solvers.algebra.solid_factors import NODE_SIZE, SolidFactors
from solvers.api import Array, FailureKind, Indices
from solvers.counted import counted

Method = Literal["auto", "direct", "iterative", "ilu"]

#: Unknowns above which the iterative solver is used. Measured on one core (`make bench`): with hex8 it is faster from
#: 5,000 (compact bodies) or 25,000 (slender ones) on, with second order and thin cells from 50,000 on.
DIRECT_LIMIT = {2: 400_000, 3: 30_000}


# Newer PETSc computes several dot products at once by BLAS, whose sums depend on the alignment of vectors in memory.
# Results would then differ in the last digits from run to run, and of resumed from uninterrupted runs.
for _option in ("vec_mdot_use_gemv", "vec_maxpy_use_gemv"):
    PETSc.Options()[_option] = False


_KSP_REASONS = PETSc.KSP.ConvergedReason
#: What PETSc reports of a Krylov method that stopped without a solution.
WHY_STALLED = {
    _KSP_REASONS.DIVERGED_MAX_IT: "it reached its limit of iterations",
    _KSP_REASONS.DIVERGED_DTOL: "its residual grew",
    _KSP_REASONS.DIVERGED_BREAKDOWN: "its directions became dependent",
    _KSP_REASONS.DIVERGED_INDEFINITE_PC: "the preconditioner is not positive definite",
    _KSP_REASONS.DIVERGED_INDEFINITE_MAT: "the matrix is not positive definite",
    _KSP_REASONS.DIVERGED_NANORINF: "a number is not finite",
}


class LinearSolveFailed(ArithmeticError):
    """The linear system has no solution: the matrix is singular, or the Krylov method stalled."""

    def __init__(self, message: str, *, singular: bool = False):
        super().__init__(message)
        self.singular = singular

    @property
    def kind(self) -> FailureKind:
        """Of the step that fails for it."""
        return FailureKind.UNSUPPORTED if self.singular else FailureKind.LINEAR_SOLVER


def choose(method: Method, dim: int, dofs: int) -> Literal["direct", "iterative", "ilu"]:
    """The method for a system of this size."""
    if method == "auto":
        return "direct" if dofs <= DIRECT_LIMIT[dim] else "iterative"
    return method


#: (communicator, task) -> solver
Maker: TypeAlias = Callable[[Any, "Task"], PETSc.KSP]

#: Unknowns of a 2D problem below which PETSc's own factorisation is as fast as MUMPS or up to 6 times faster, on one
#: process. It orders by nested dissection: bandwidth reduction is 1.5 times faster for slender bodies, but 5 times
#: slower for square ones.
SMALL_PLANE = 4_000

#: Pivot below which PETSc takes a matrix for singular. Its default of 2e-14 assumes entries of size 1: in units where
#: the stiffness is 1e-21, regular matrices were refused. `flown_off` detects bodies without supports.
ZERO_PIVOT = 1e-300


@dataclass(frozen=True)
class Task:
    """Properties of a linear system by which a solver is configured."""

    dim: int
    dofs: int  #: unknowns on all processes
    symmetric: bool
    tolerance: float  #: |b - A x| < tolerance |b|, of Krylov methods


def direct_solver(comm, task: Task) -> PETSc.KSP:
    """LDL^T of a symmetric matrix, LU otherwise: by PETSc for small 2D problems on one process, else by MUMPS."""
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
MULTIGRID: Mapping[str, str | float] = {
    "pc_type": "gamg",
    "pc_gamg_type": "agg",
    "pc_gamg_threshold": 0.04,
    "mg_levels_ksp_type": "chebyshev",
    "mg_levels_ksp_max_it": 2,
    "mg_levels_pc_type": "jacobi",
}


def elastic_solver(comm, task: Task) -> PETSc.KSP:
    """GMRES with algebraic multigrid until |b - A x| < tolerance |b|; the matrix has the rigid-body modes.

    GMRES instead of CG, because the tangent may be indefinite at an iterate far from the solution.
    """
    return _gmres(comm, task.tolerance, 500, restart=100, prefix="elastic_")


def _gmres(
    comm, tolerance: float, iterations: int, *, restart: int = 30, flexible: bool = False, prefix: str = ""
) -> PETSc.KSP:
    """GMRES preconditioned from the right, until |b - A x| < tolerance |b|; flexible: FGMRES."""
    ksp = PETSc.KSP().create(comm)
    if prefix:
        ksp.setOptionsPrefix(prefix)
    ksp.setType(PETSc.KSP.Type.FGMRES if flexible else PETSc.KSP.Type.GMRES)
    ksp.setPCSide(PETSc.PC.Side.RIGHT)
    ksp.setGMRESRestart(restart)
    ksp.setTolerances(rtol=tolerance, max_it=iterations)
    return ksp


def _from_options(comm, prefix: str, options: Mapping[str, str | float]) -> PETSc.PC:
    """A preconditioner with these options."""
    for name, value in options.items():
        PETSc.Options(prefix)[name] = value
    preconditioner = PETSc.PC().create(comm)
    preconditioner.setOptionsPrefix(prefix)
    preconditioner.setFromOptions()
    return preconditioner


def _multigrid(comm) -> PETSc.PC:
    """A new multigrid hierarchy for one matrix.

    A reused one would take 3 times the iterations after bodies have rotated, because PETSc keeps its first modes, and a
    resumed run would not have it.
    """
    return _from_options(comm, "elastic_", MULTIGRID)


#: Linear solvers of flows.
FlowMethod = Literal["multigrid", "smoothed", "ilu", "fill", "direct"]


def choose_flow(
    method: Method,
    dim: int,
    dofs: int,
    *,
    degree: int,
    steady: bool,
    with_solids: bool = False,
    rough: bool = False,
) -> tuple[FlowMethod, ...]:
    """The sequence of solvers for a flow: each is used when those before it have failed.

    degree: of the velocity; incomplete factors with more fill take minutes for second degree, and are left out.
    smoothed: multigrid with stronger smoothers, which second degree always has.
    with_solids: equations of elastic bodies may belong to the system. rough: single steps of smoothers diverge in
    steady flow, as on stretched cells.
    """
    if method == "direct" or (method == "auto" and dofs <= FLOW_DIRECT_LIMIT[dim]):
        return ("direct",)
    limit = (FLOW_WITH_SOLIDS_LIMIT if with_solids else FLOW_INCOMPLETE_LIMIT)[degree]
    if method == "ilu" or (method == "auto" and not steady and dofs <= limit):
        return ("ilu", "multigrid", "direct") if degree > 1 else ("ilu", "multigrid", "smoothed", "direct")
    if degree > 1:
        return ("multigrid", "direct")
    return ("smoothed", "fill", "direct") if steady and rough else ("multigrid", "smoothed", "fill", "direct")


#: Unknowns of a flow above which an iterative solver is used. In 3D it is 4 times faster at 8,000 unknowns.
FLOW_DIRECT_LIMIT = {2: 400_000, 3: 4_000}

#: Unknowns of an unsteady flow above which multigrid is faster than incomplete factors, by degree. Measured times per
#: step: `channel` takes 7 % less at 20,000 and 22 % less at 62,000, on two processes 20 % less at 37,000; q2q1 with
#: incomplete factors takes 1.4 s instead of 2.8 s at 15,000, but 9.4 s instead of 5.6 s at 49,000.
FLOW_INCOMPLETE_LIMIT = {1: 20_000, 2: 25_000}
#: The same with solids. `torus_wall` (14,200) takes 15 us per unknown and Newton step with incomplete factors, 18 with
#: multigrid; `torus_wall_fine` (102,500) 14 and 17, on two processes 8.6 and 9.5.
FLOW_WITH_SOLIDS_LIMIT = {1: 200_000, 2: 25_000}


#: Options of incomplete factors: of dense blocks, and with more fill and overlap.
BLOCKS: dict[str, str | float] = {"sub_pc_type": "python", "sub_pc_python_type": f"{__package__}.incomplete.Incomplete"}
#: With more fill and overlap, for systems on which FGMRES stalls otherwise.
FILL: dict[str, str | float] = {"pc_asm_overlap": 2, "sub_pc_factor_levels": 1}


def flow_solver(comm, *, tolerance: float, fill: bool = False) -> PETSc.KSP:
    """FGMRES with incomplete factors on overlapping subdomains.

    fill: more fill and overlap, for systems on which FGMRES stalls otherwise.
    """
    ksp = _schwarz_solver(comm, "flow_fill_" if fill else "flow_", tolerance, **(FILL if fill else BLOCKS))
    # keeps the preconditioned vectors: factors in single precision round each product with them otherwise
    ksp.setType(PETSc.KSP.Type.FGMRES)
    return ksp


def flexible_solver(comm, *, tolerance: float) -> PETSc.KSP:
    """FGMRES for a preconditioner that may change from iteration to iteration."""
    return _gmres(comm, tolerance, 200, restart=100, flexible=True)


def incomplete_solver(comm, task: Task) -> PETSc.KSP:
    """GMRES with incomplete factors on overlapping subdomains for solids: cheaper than multigrid, but less robust.

    Measured with contact: 4 times faster than LU for dynamics and for compact bodies (16 and 90 iterations), not faster
    for thin bodies in statics. Reordering by bandwidth (rcm) reduces the iterations by a third. In 3D on one process
    the factors are those of blocks in single precision, a third of the time; FGMRES keeps the preconditioned vectors.
    """
    ksp = _entry_solver(comm, task.tolerance)
    if task.dim == NODE_SIZE and comm.size == 1 and task.dofs % NODE_SIZE == 0:
        ksp.setType(PETSc.KSP.Type.FGMRES)
        ksp.getPC().setType(PETSc.PC.Type.PYTHON)
        ksp.getPC().setPythonContext(SolidFactors())
    return ksp


def _entry_solver(comm, tolerance: float) -> PETSc.KSP:
    return _schwarz_solver(comm, "incomplete_", tolerance, sub_pc_factor_mat_ordering_type="rcm")


#: Solvers for solids by the names of methods. A field also accepts a function of this type.
SOLVERS: Mapping[str, Maker] = {"direct": direct_solver, "iterative": elastic_solver, "ilu": incomplete_solver}


def _schwarz_solver(comm, prefix: str, tolerance: float, **more: str | float) -> PETSc.KSP:
    options = PETSc.Options(prefix)
    for name, value in incomplete_factors(comm, **more).items():
        options[name] = value
    ksp = _gmres(comm, tolerance, 600, restart=150, prefix=prefix)
    ksp.setFromOptions()
    return ksp


def incomplete_factors(comm, **more: str | float) -> dict[str, str | float]:
    """Options of incomplete factors on overlapping subdomains; on one process without subdomains, to save a copy."""
    given: dict[str, str | float] = {"sub_pc_type": "ilu", "sub_pc_factor_levels": 0, **more}
    given["sub_pc_factor_zeropivot"] = ZERO_PIVOT
    if comm.size > 1:
        return {"pc_type": "asm", "pc_asm_overlap": 1, **given}
    return {name.removeprefix("sub_"): value for name, value in given.items() if name.startswith("sub_")}


def coupled_solver(
    comm,
    *,
    tolerance: float,
    fill: bool = False,
    flow: PETSc.PC | None = None,
    few: Indices | None = None,
    levels: Array | None = None,
) -> PETSc.KSP:
    """FGMRES for structure and flow together, a matrix of `TwoFields`, with block Gauss-Seidel as preconditioner.

    That of the structure is `solid_preconditioner`; flow: that of the flow, None: incomplete factors on overlapping
    subdomains (fill: more fill and overlap). few: numbers of unknowns of the structure that are eliminated exactly;
    levels: pressure levels of the flow that the structure determines, shape (owned unknowns, levels).
    """
    if flow is None:
        flow = _from_options(comm, "coupled_flow_", incomplete_factors(comm, **(FILL if fill else BLOCKS)))
    ksp = _gmres(comm, tolerance, 600, restart=150, flexible=True)
    blocks = GaussSeidel(solid_preconditioner, flow, levels)
    if few is None or len(few) == 0:
        _set_context(ksp.getPC(), blocks)
    else:
        others = PETSc.PC().create(comm)
        _set_context(others, blocks)
        _set_context(ksp.getPC(), FewUnknowns(few, others))
    return ksp


def _set_context(preconditioner: PETSc.PC, context: PythonContext) -> None:
    preconditioner.setType(PETSc.PC.Type.PYTHON)
    preconditioner.setPythonContext(context)


#: Unknowns of a solid up to which its LU factors cost next to nothing in a coupled system.
SMALL_SOLID = 1_000

#: Incomplete factors of a solid are good if GMRES with them reduces a random residual by this factor within so many
#: iterations. Measured counts: 3 to 6 for bodies in motion, compact or thin, 9 for a static cube, 70 to 230 for static
#: bars and plates.
TRIAL_REDUCTION, TRIAL_ITERATIONS = 1e-2, 10


def solid_preconditioner(matrix: PETSc.Mat) -> PETSc.KSP:
    """Incomplete factors of a solid if they are good, LU factors by MUMPS otherwise (collective).

    LU factors take a fifth of the time of `torus_wall`, and on several processes most of their time is a wait.
    """
    comm, size = matrix.comm, matrix.size[0]
    applied = PETSc.KSP().create(comm)
    applied.setType(PETSc.KSP.Type.PREONLY)
    if size > SMALL_SOLID:
        trial = _entry_solver(comm, TRIAL_REDUCTION)
        trial.setTolerances(max_it=TRIAL_ITERATIONS)
        b, x = matrix.createVecs()
        b.array[:] = _random_signs(comm.rank, b.local_size)
        trial.setOperators(matrix)
        trial.solve(b, x)
        if trial.getConvergedReason() > 0:
            applied.setPC(trial.getPC())
            return applied
    applied.getPC().setType(PETSc.PC.Type.LU)
    applied.getPC().setFactorSolverType("mumps")
    applied.setOperators(matrix)
    applied.setUp()
    return applied


def factored_solver(comm, *, iterations: int) -> PETSc.KSP:
    """GMRES preconditioned with LU factors by MUMPS, for the matrix of the factors and for later ones."""
    ksp = _gmres(comm, 1e-8, iterations)
    ksp.getPC().setType(PETSc.PC.Type.LU)
    ksp.getPC().setFactorSolverType("mumps")
    return ksp


#: Reduction of the residual that stands for an exact solution.
EXACT = 1e-13


def krylov_around(direct: PETSc.KSP) -> PETSc.KSP:
    """GMRES with the factors of a direct solver, for their matrix plus one of low rank r: exact in r + 1 iterations."""
    ksp = _gmres(direct.comm, EXACT, 100)
    ksp.setPC(direct.getPC())
    return ksp


#: Iterations that cost less than another iterate of Newton's method may: assembly takes the time of 20 to 50.
FEW = 10


def solve(
    ksp: PETSc.KSP,
    matrix: PETSc.Mat,
    b: PETSc.Vec,
    x: PETSc.Vec,
    preconditioned_by: PETSc.Mat | None = None,
    *,
    reduction: float = 0.0,
    squared: bool = False,
    few: int = FEW,
) -> tuple[int, float]:
    """Solve matrix x = b (collective); returns iterations and the reduction reached. Raises LinearSolveFailed.

    preconditioned_by: the matrix of an earlier solve whose preconditioner is reused; None: `matrix`. reduction: of the
    residual that is good enough for a Krylov method. Where that costs `few` iterations, or if `squared`, it is solved
    to the square, with which Newton's method converges as with an exact solution.
    """
    if ksp.getOptionsPrefix() == "elastic_":
        ksp.setPC(_multigrid(ksp.comm))
    for comm in (ksp.comm, matrix.comm):
        free_deleted(comm)
    ksp.setOperators(matrix, preconditioned_by)
    tolerance, before = ksp.getTolerances()[0], 0
    if reduction > tolerance and ksp.getType() != PETSc.KSP.Type.PREONLY:
        exact = max(tolerance, reduction**2)
        ksp.setTolerances(rtol=exact if squared else reduction)
        unlocked.solve(ksp, b, x)
        if not squared and ksp.getConvergedReason() > 0 and ksp.getIterationNumber() <= few:
            before, reduction = ksp.getIterationNumber(), exact
            ksp.setTolerances(rtol=exact)
            ksp.setInitialGuessNonzero(True)
            unlocked.solve(ksp, b, x)
            ksp.setInitialGuessNonzero(False)
        ksp.setTolerances(rtol=tolerance)
    else:
        unlocked.solve(ksp, b, x)
    reason = ksp.getConvergedReason()
    if reason < 0:
        failed = PETSc.KSP.ConvergedReason.DIVERGED_PCSETUP_FAILED
        if ksp.getType() == PETSc.KSP.Type.PREONLY or reason == failed:
            raise LinearSolveFailed("the linear system is singular: is a body not supported?", singular=True)
        raise LinearSolveFailed(
            f"the linear solver stalled after {counted(ksp.getIterationNumber(), 'iteration')} ({reason_of(ksp)})"
        )
    return before + int(ksp.getIterationNumber()), reduction


def reason_of(ksp: PETSc.KSP) -> str:
    """Why a linear solver stopped without a solution."""
    reason = ksp.getConvergedReason()
    return WHY_STALLED.get(reason, f"PETSc gives the reason {reason}")


@lru_cache(maxsize=8)
def _random_signs(rank: int, n: int) -> Array:
    """The n signs of a process, the same in every call."""
    return np.random.default_rng(rank).choice((-1.0, 1.0), n)
