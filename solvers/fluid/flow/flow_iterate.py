"""The iterate of Newton's method on one set of unknowns of a flow: rows, tangent, and the last increment."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra import linear
from solvers.algebra.largest import position_of_largest
from solvers.api import Array, StepFailed
from solvers.fluid.flow.carrier import Carrier
from solvers.fluid.solve.kept_tangent import KeptTangent
from solvers.fluid.solve.linear_systems.krylov import FlowSolver, SolverSequence
from solvers.fluid.solve.pressure_level import PressureLevels
from solvers.fluid.solve.system import FlowSystem
from solvers.timing import Timer


class FlowIterate:
    """Arrays are at owned dofs, calls are collective; other cells get another one. It has what Krylov methods need."""

    def __init__(self, system: FlowSystem, levels: PressureLevels, solver: FlowSolver, tolerance: float, timer: Timer):
        self._system, self._unknowns, self._levels, self._timer = system, system.unknowns, levels, timer
        self._size = size = system.unknowns.owned
        self.solver, self.linear_tolerance = solver, tolerance
        self.held = np.zeros(size, dtype=bool)  #: dofs with rows of the identity
        self.rows = np.zeros(size)  #: the residual [N, m^3/s]
        self.linear_iterations = 0  #: of the last linear system
        self._tangent = KeptTangent(system)
        self._increment, self._before = np.zeros(size), np.zeros(size)  #: the last one, and the flow before it
        self._share = 1.0  #: of the last increment that the iterate has

    @property
    def sequence(self) -> SolverSequence:
        """Linear solvers, from fast to robust."""
        return self.solver.sequence

    def values(self) -> Array:
        """Velocity [m/s] and pressure [Pa], whose rounding enters the residual (a view)."""
        found: Array = self._system.flow.x.array[: self._size]
        return found

    def begin_step(self) -> None:
        """Discard tangent and preconditioners of the last step."""
        self._tangent.begin_step()
        self.solver.begin_step()

    def hold(self, *, set_by_solids: bool) -> None:
        """Find the rows of the identity on a new cut; set_by_solids: see `PressureLevels.hold`."""
        self.held = self._system.held()
        self._levels.hold(self.held, set_by_solids=set_by_solids)

    def residual(self) -> Array:
        """Assemble the rows; zero at held dofs."""
        self.rows, change = self._assembled()
        self._system.driving.take(change)
        return self.rows

    def _assembled(self) -> tuple[Array, Array]:
        """(the rows, the change of the driving forces that balances them)."""
        with self._timer("assembly"):
            rows = self._system.residual()
        self._levels.spread_excess(rows)
        rows[self.held] = 0.0
        return self._system.driving.eliminated(rows, self.values(), self.held)

    def residual_of(self, flow: Array) -> Array:
        """The rows of another flow, at local dofs, with the viscosity that cut cells have now."""
        present = self._system.flow.x.array.copy()
        self._system.flow.x.array[:] = flow
        with self._system.viscosity.kept():
            found, _ = self._assembled()
        self._system.flow.x.array[:] = present
        return found

    def local_values(self) -> Array:
        """A copy of `values` with those of other processes."""
        found: Array = self._system.flow.x.array.copy()
        return found

    def keep_rows(self, kept: NDArray[np.int32]) -> None:
        """Set all other rows to zero."""
        rows, self.rows = self.rows, np.zeros(self._size)
        self.rows[kept] = rows[kept]

    def norm(self, rows: Array, h: float, alpha: float) -> float:
        """Norm [N] of momentum rows and of continuity rows times the impedance of a cell.

        h: length of its edge [m]; alpha [1/s]: du_t/du.
        """
        system = self._system
        mu = system.viscosity.where_it_shears(system.flow.x.array)
        impedance = mu / h + system.settings.density * (system.fastest + h * alpha)
        scaled = np.where(self._unknowns.velocity_mask[: len(rows)], rows, impedance * rows)
        return math.sqrt(self._unknowns.grid.comm.allreduce(float(scaled @ scaled)))

    def keep_levels(self) -> None:
        """Shift the pressure of pockets to the level that they keep, see `PressureLevels.keep`."""
        self._levels.keep(self.values())
        self._unknowns.share(self._system.flow)

    def unsolved(self) -> tuple[float, float]:
        """Sums of |row|: of the momentum [N] and of the continuity equations [m^3/s]."""
        size, in_momentum = np.abs(self.rows), self._unknowns.velocity_mask[: self._size]
        both = np.array([size[in_momentum].sum(), size[~in_momentum].sum()])
        force, rate = self._unknowns.grid.comm.allreduce(both)
        return float(force), float(rate)

    # --------------------------------------------------------------------------------------------------- the tangent

    def linearise(self, *, picard: bool) -> PETSc.Mat:
        """The tangent at the present iterate; held rows are those of the identity. The next call overwrites it."""
        with self._timer("assembly"):
            return self._tangent.linearise(self.held, self.values(), picard=picard)

    def keeps_tangent(self) -> bool:
        """Whether the last tangent has its rows of the identity where this iterate has them, on this process."""
        return self._tangent.holds(self.held)

    def solve(self, solver: FlowSolver, *, keep: bool, picard: bool, reduction: float) -> Array:
        """The next increment; keep: with the tangent of the last one. Raises StepFailed.

        reduction: of the residual that is good enough.
        """
        matrix = self._tangent.of_increment(lambda: self.linearise(picard=picard), keep=keep)
        b, x = matrix.createVecs()
        b.array[:] = -self.rows
        try:
            with self._timer("solve"):
                self.linear_iterations = solver.solve(
                    matrix, b, x, self.held, self._system, added=self.added_product(), reduction=reduction
                )
        except linear.LinearSolveFailed as failure:
            raise StepFailed("fluid", failure.kind, str(failure), where=self.worst()) from failure
        return x.array

    def added_product(self) -> Callable[[Array], Array] | None:
        """The part of low rank of the tangent, as a product with owned values; None: zero."""
        return self._tangent.added_product(self.held)

    def multigrid(self, matrix: PETSc.Mat, product: PETSc.Mat) -> PETSc.PC:
        """A multigrid cycle for the tangent, which it multiplies by `product`; the next call overwrites it."""
        levels = self.free_levels()
        return self.solver.create_multigrid().preconditioner(matrix, self.held, self._system, product, levels)

    def product(self, matrix: PETSc.Mat, reduction: float) -> PETSc.Mat:
        """The tangent as it multiplies vectors in a Krylov method; the next call overwrites it.

        reduction: of the residual that is good enough.
        """
        return self.solver.products.of(matrix, max(self.linear_tolerance, reduction))

    def free_levels(self) -> Array | None:
        """Pressure levels that no row of the flow determines, 1 at their owned dofs, shape (owned, levels)."""
        return self._levels.free()

    def add_rounding(self, error: Array) -> None:
        """Add rounding errors that another field causes in these equations; call it after `linearise`."""
        self._tangent.add_rounding(error)

    def rounding(self, *, picard: bool) -> Array:
        """Rounding errors of the rows where this step linearised last; their norm counts, see `Fluid.only_rounding`.

        Not row by row: entries of the matrix near surfaces are sums whose terms cancel, and so are underestimated rows.
        A norm cannot hide anything, because rows of one fluid have errors of one size.
        """
        return np.where(self.held, 0.0, self._tangent.rounding_error(lambda: self.linearise(picard=picard)))

    def worst(self) -> tuple[float, ...] | None:
        """Position [m] of the node with the largest momentum residual."""
        nodes = self._unknowns.velocity
        size = np.abs(np.nan_to_num(self.rows[nodes.dofs[: nodes.owned]], nan=np.inf)).max(axis=1)
        return position_of_largest(self._unknowns.grid.comm, size, nodes.points)

    # ------------------------------------------------------------------------------------------------- the increment

    def begin_guess(self) -> None:
        """Keep the flow before it is extrapolated; `end_guess` takes the change for the last increment."""
        self._before, self._share = self.values().copy(), 1.0

    def end_guess(self) -> None:
        self._increment = self.values() - self._before

    def add(self, increment: Array) -> tuple[Array, Array]:
        """Add an increment; returns it and the flow after it, times the diagonal of the tangent."""
        self._increment = increment.copy()
        self._before, self._share = self.values().copy(), 1.0
        self._set_share()
        return self._tangent.diagonal * self._increment, self._tangent.diagonal * self.values()

    def retreat(self, fraction: float) -> None:
        """Take back a fraction of the last increment.

        The state before is kept: a cut that covers nodes, or holds their pressure, overwrites their values.
        """
        self._share -= fraction
        self._set_share()

    def _set_share(self) -> None:
        self.values()[:] = self._before + self._share * self._increment
        self._unknowns.share(self._system.flow)

    def carry(self, old: FlowIterate, carrier: Carrier) -> None:
        """Take the last increment of the iterate on other cells."""
        ghosts = 0, carrier.old.local - carrier.old.owned
        self._before, self._increment = (
            carrier.flow(np.pad(values, ghosts))[: self._size] for values in (old._before, old._increment)
        )
