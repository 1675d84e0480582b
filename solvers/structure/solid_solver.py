"""The solvers of the linear systems of a structure, and the sequence of them that `auto` tries near contact."""

from __future__ import annotations

from collections.abc import Callable

from petsc4py import PETSc

from solvers.algebra import linear
from solvers.algebra.added_product import with_product
from solvers.api import Array
from solvers.solver_settings import SolverSettings

#: Iterations after which incomplete factors are given up if another solver follows: FIRST, and one more for each
#: PER_ITERATION unknowns, up to MOST_ITERATIONS. That is about half the time of the direct solver. Measured with Hertz
#: contact on one core, 450, 2,187 and 10,125 unknowns: a direct solution takes the time of 30, 110 and 330 iterations.
#: The first system takes 17, 29 and 75 of them to 1e-6; that of a bent plate in contact, 2,034 and 3,258 unknowns, 72
#: and 130.
FIRST, PER_ITERATION, MOST_ITERATIONS = 20, 60, 300

#: Tolerance of the linear systems relative to Newton's where `auto` replaces a direct solver: away from contact one
#: solution may be all that is needed. Below LEAST_TOLERANCE there are rounding errors.
OF_NEWTON, LEAST_TOLERANCE = 0.01, 1e-12

#: Unknowns up to which a direct solver follows multigrid, which stalls for nearly incompressible bodies. Factors of a
#: cube of 36,501 unknowns take 0.5 GB, and grow as n^(4/3).
FACTORS_FIT = 200_000


def choose(method: linear.Method, dim: int, dofs: int, *, contact: bool) -> tuple[str, ...]:
    """Names of solvers in the order of trial: each is used when those before it have failed."""
    chosen = linear.choose(method, dim, dofs)
    if method != "auto":
        return (chosen,)
    first = ("ilu",) if dim == 3 and contact else ()
    last = ("direct",) if chosen == "iterative" and dofs <= FACTORS_FIT else ()
    return (*first, chosen, *last)


def iterations_allowed(dofs: int) -> int:
    """Iterations after which incomplete factors of a system of this size are given up if another solver follows."""
    return min(FIRST + dofs // PER_ITERATION, MOST_ITERATIONS)


class SolidSolver:
    """Solves the linear systems of a structure: symmetric ones away from contact, others in contact.

    When a solver fails, the next one of the sequence replaces it for the rest of the run. Iterations alone decide that,
    and `position` is part of the state, so that resumed runs give the same results.

    The first system of a step is a trial: it is solved to the square of what is good enough. In soft modes, such as the
    bending of plates, a small residual does not mean a small error. There Newton's method took up to twice the steps
    with such solutions, and with the trial the plates of above are left to the direct solver.
    """

    def __init__(self, comm, dim: int, dofs: int, settings: SolverSettings, *, contact: bool):
        self._comm, self._dim, self._dofs, self._settings = comm, dim, dofs, settings
        method = settings.linear
        self.sequence: tuple[str | linear.Maker, ...] = (
            choose(method, dim, dofs, contact=contact) if isinstance(method, str) else (method,)
        )
        self.position = 0
        self._solvers: dict[tuple[int, bool], PETSc.KSP] = {}
        self._around: dict[tuple[int, bool], PETSc.KSP] = {}
        self._tried = False

    def begin_step(self) -> None:
        """Let the next system be a trial."""
        self._tried = False

    @property
    def _incomplete_first(self) -> bool:
        return self.sequence[0] == "ilu" and len(self.sequence) > 1

    @property
    def _last(self) -> bool:
        return self.position == len(self.sequence) - 1

    @property
    def _on_trial(self) -> bool:
        return self._incomplete_first and self.position == 0 and not self._tried

    def current(self, *, symmetric: bool) -> PETSc.KSP:
        """The present solver for symmetric or for all matrices."""
        key = self.position, symmetric
        if key not in self._solvers:
            self._solvers[key] = self._create(symmetric=symmetric)
        return self._solvers[key]

    def _create(self, *, symmetric: bool) -> PETSc.KSP:
        method, tolerance = self.sequence[self.position], self._settings.linear_tolerance
        if self._incomplete_first:
            tolerance = min(tolerance, max(LEAST_TOLERANCE, OF_NEWTON * self._settings.newton.residual))
        make = linear.SOLVERS[method] if isinstance(method, str) else method
        ksp = make(self._comm, linear.Task(self._dim, self._dofs, symmetric, tolerance))
        if not self._last:
            ksp.setTolerances(max_it=iterations_allowed(self._dofs))
        return ksp

    def _iterating(self, *, symmetric: bool) -> PETSc.KSP:
        """The present solver as a Krylov method."""
        solver, key = self.current(symmetric=symmetric), (self.position, symmetric)
        if solver.getType() != PETSc.KSP.Type.PREONLY:
            return solver
        if key not in self._around:
            self._around[key] = linear.krylov_around(solver)
        return self._around[key]

    def solve(
        self,
        matrix: PETSc.Mat,
        b: PETSc.Vec,
        x: PETSc.Vec,
        attach_modes: Callable[[PETSc.Mat], None],
        *,
        symmetric: bool,
        reduction: float = 0.0,
        added: Callable[[Array], Array] | None = None,
    ) -> None:
        """Solve (matrix + added) x = b (collective). Raises LinearSolveFailed.

        added: product of a part of low rank with owned unknowns, for which direct solvers become preconditioners.
        attach_modes: attaches the rigid modes to a matrix, for multigrid; reduction: see `linear.solve`.
        """
        while True:
            if self.sequence[self.position] == "iterative":
                attach_modes(matrix)
            solver, trial = self.current(symmetric=symmetric), self._on_trial
            try:
                if added is None:
                    linear.solve(solver, matrix, b, x, reduction=reduction, squared=trial)
                else:
                    solver = self._iterating(symmetric=symmetric)
                    whole = with_product(matrix, added)
                    linear.solve(solver, whole, b, x, matrix, reduction=reduction, squared=trial)
            except linear.LinearSolveFailed:
                if self._last:
                    raise
                self.position += 1
            else:
                self._tried = True
                return
