"""Iterative solution of the linear systems of the flow, and the sequence of solvers to try when one fails."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra import linear
from solvers.algebra.added_product import with_product
from solvers.algebra.lagged import Lagged, LaggedFactors
from solvers.algebra.rounded_product import RoundedProducts
from solvers.api import Array
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.solve.linear_systems.multigrid import Multigrid, Surfaces

#: Names of the methods in messages.
IN_WORDS: dict[linear.FlowMethod, str] = {
    "multigrid": "multigrid",
    "smoothed": "multigrid with stronger smoothers",
    "ilu": "incomplete factors",
    "fill": "incomplete factors with more fill and overlap",
    "direct": "the direct solver",
}
#: Convection makes coarse corrections of steady flows poor. V-cycles take 4, 8, and 10 to 13 iterations with 62,500,
#: 470,596 and 1,000,188 unknowns (Reynolds number 200), W-cycles 4, 5, and 6 or 7. In time both take as many, and
#: V-cycles take 8 % less time.
STEADY_CYCLE = PETSc.PC.MGCycleType.W
#: Iterations of multigrid after which stronger smoothers are taken: it usually takes 4 to 13, where single steps of the
#: smoother converge. On stretched cells, and on nested ones in fast flow, these diverge, and so would 200 iterations.
#: No flow has been seen that takes between 17 and 200: any number between these chooses the same.
MULTIGRID_ITERATIONS = 30
#: Memory [bytes] of the factors of a 3D flow with n unknowns over n^(4/3): 490 measured for q1q1, 1,040 for q2q1.
BYTES_OF_FACTORS = 1_100.0


class SolverSequence:
    """A sequence of solvers: if the current one fails, the next one replaces it. `position` is part of the state."""

    def __init__(self, comm: MPI.Comm, methods: Sequence[linear.FlowMethod], dofs: int, note: Callable[[str], None]):
        self.comm, self.methods, self.dofs, self._note = comm, methods, dofs, note
        self.position = 0

    @property
    def current(self) -> linear.FlowMethod:
        return self.methods[self.position]

    @property
    def multigrid(self) -> bool:
        """Whether the current solver is multigrid, with whatever smoothers."""
        return self.current in ("multigrid", "smoothed")

    def limit(self, ksp: PETSc.KSP) -> None:
        """Let a solver give up early if multigrid with stronger smoothers comes next."""
        if "smoothed" in self.methods and self.current == "multigrid":
            ksp.setTolerances(max_it=min(MULTIGRID_ITERATIONS, ksp.getTolerances()[3]))

    def replaced(self, methods: Sequence[linear.FlowMethod], dofs: int) -> SolverSequence:
        """The sequence for another discretisation, which begins with the first solver that has not failed yet."""
        failed = self.methods[: self.position]
        found = SolverSequence(self.comm, methods, dofs, self._note)
        found.position = next((n for n, method in enumerate(methods) if method not in failed), len(methods) - 1)
        return found

    def advance(self, failure: linear.LinearSolveFailed) -> None:
        """Change to the next solver for the rest of the run. Raises LinearSolveFailed if there is none (collective)."""
        if failure.singular or self.position == len(self.methods) - 1:
            raise failure
        need, free = BYTES_OF_FACTORS * self.dofs ** (4.0 / 3.0), free_memory(self.comm)
        if self.methods[self.position + 1] == "direct" and need > free:
            raise linear.LinearSolveFailed(
                f"{failure} with {IN_WORDS[self.current]}, and the direct solver would need about {need / 1e9:.3g} GB "
                f"of the {free / 1e9:.3g} GB that are free; take cells that grow less from one to the next, "
                f"'element: q1q1', or a larger 'solver.linear.tolerance'"
            ) from failure
        before = IN_WORDS[self.current]
        self.position += 1
        self._note(f"{failure} with {before}: {IN_WORDS[self.current]} from here on ('solver.linear.method' chooses)")


def free_memory(comm: MPI.Comm) -> float:
    """Smallest free memory of all processes [bytes] (collective)."""
    return float(comm.allreduce(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"), op=MPI.MIN))


class FlowSolver:
    """Solves with the current solver of the sequence, and reuses the preconditioner of an earlier matrix of the step.

    Only the position of the sequence is kept from step to step, so that resumed runs give the same results.
    """

    def __init__(self, unknowns: Unknowns, sequence: SolverSequence, tolerance: float, *, steady: bool):
        self.sequence, self._unknowns, self._tolerance = sequence, unknowns, tolerance
        self.products = RoundedProducts()
        self._cycle = STEADY_CYCLE if steady else PETSc.PC.MGCycleType.V
        self._levels: dict[bool, Multigrid] = {}  #: with stronger smoothers or without
        fresh = math.inf if steady else 1  # a steady flow changes too much from iterate to iterate
        self._krylov, self._direct = Lagged(fresh=fresh), LaggedFactors(sequence.comm, fresh=fresh)

    def create_multigrid(self) -> Multigrid:
        """The levels of multigrid, with the smoothers of the current solver; created once (collective)."""
        smoothed = self.sequence.current == "smoothed"
        if smoothed not in self._levels:
            self._levels[smoothed] = Multigrid(self.sequence.comm, self._unknowns, self._cycle, smoothed=smoothed)
        return self._levels[smoothed]

    def for_sources(self) -> FlowSolver:
        """A solver for a right-hand side of sources of volume; its failures leave the sequence of the run as it is.

        Their pressure reaches through the whole flow. Incomplete factors stall there, multigrid does not.
        """
        sequence = self.sequence
        rest = sequence.methods[sequence.position :]
        first = next((n for n, method in enumerate(rest) if method in ("multigrid", "smoothed")), 0)
        methods = rest[first:]
        own = SolverSequence(sequence.comm, methods, sequence.dofs, lambda message: None)
        return FlowSolver(self._unknowns, own, self._tolerance, steady=False)

    def begin_step(self) -> None:
        """Discard preconditioners of the last step."""
        self._krylov.begin_step()
        self._direct.begin_step()

    def solve(
        self,
        matrix: PETSc.Mat,
        b: PETSc.Vec,
        x: PETSc.Vec,
        held: NDArray[np.bool_],
        surfaces: Surfaces,
        *,
        added: Callable[[Array], Array] | None = None,
        reduction: float = 0.0,
    ) -> int:
        """Solve (matrix + added) x = b. Returns the count of iterations. Raises LinearSolveFailed (collective).

        held: owned unknowns whose rows are those of the identity; added: a part of low rank as a product with vectors;
        reduction: of the residual that is good enough.
        """

        def whole(product: PETSc.Mat) -> PETSc.Mat:
            return product if added is None else with_product(product, added)

        tolerance = max(self._tolerance, reduction)
        while self.sequence.current != "direct":
            try:
                product = self.products.of(matrix, tolerance)
                iterations = self._krylov.solve_again(whole(product), b, x, reduction=reduction)
                if iterations is not None:
                    return iterations
                ksp = self._create(matrix, held, surfaces, product)
                return self._krylov.solve(ksp, whole(product), b, x, matrix, reduction=reduction)
            except linear.LinearSolveFailed as failure:
                self.sequence.advance(failure)
        return self._direct.solve(whole(matrix), b, x, matrix)

    def _create(self, matrix: PETSc.Mat, held: NDArray[np.bool_], surfaces: Surfaces, product: PETSc.Mat) -> PETSc.KSP:
        comm, method = self.sequence.comm, self.sequence.current
        if not self.sequence.multigrid:
            return linear.flow_solver(comm, tolerance=self._tolerance, fill=method == "fill")
        ksp = linear.flexible_solver(comm, tolerance=self._tolerance)
        self.sequence.limit(ksp)
        ksp.setPC(self.create_multigrid().preconditioner(matrix, held, surfaces, product))
        return ksp
