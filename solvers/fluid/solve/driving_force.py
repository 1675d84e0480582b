"""Given flow rates through periods: the uniform forces per volume that drive them, as unknowns of the equations.

With the rows r(u, G) = r(u, 0) - a G, a the rows of a unit force along a period of length L, the equations are

    r(u, G) = 0,    q = b . u = Q,    b . u = 1/L int u_along dx over the fluid.

Tested with any w, w . a not zero, the first ones give G = w . r(u, 0) / (w . a). The second one then takes its place,

    r(u, G) + a c (q - Q) = 0,

in as many unknowns: w times this is c (w . a) (q - Q). With K = dr/du at fixed G, the tangent is
K + a (c b - K^T w / (w . a))^T. Increments of Newton's method are those of the bordered system [[K, -a], [b^T, 0]]
whatever w and c, which scale the residual alone. w is a unit velocity away from bodies: their motion does not change
w . r. c is the force per rate that accelerates the fluid in a step, and with which the slowest mode of a closed box of
this size resists.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from petsc4py import PETSc

from solvers import fem
from solvers.api import EPS, Array, FailureKind, Mask, StepFailed
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.ways import leads_through
from solvers.fluid.cut.weights import Weights
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.solve.cell_viscosity import CellViscosity
from solvers.fluid.terms.forms import Coefficients
from solvers.values import Value, evaluate


class DrivingForces:
    """The forces of all periods with a rate, on the present cut. Arrays are at owned dofs; calls are collective."""

    def __init__(
        self,
        unknowns: Unknowns,
        periods: Sequence[tuple[str, int, Value]],
        functions: tuple[Any, Any, Any],
        terms: Coefficients,
        viscosity: CellViscosity,
    ):
        """periods: see `driven_periods`; functions: flow, history, and body force, which has G after each residual."""
        self._unknowns, self._comm = unknowns, unknowns.grid.comm
        self._flow, self._history, self._force = functions
        self._terms, self._viscosity = terms, viscosity
        self._axes, self._rates = [axis for _, axis, _ in periods], [rate for *_, rate in periods]
        count, owned = len(periods), unknowns.owned
        self.values = np.zeros(count)  #: G [N/m^3] at the last residual
        self._targets = np.zeros(count)  # Q
        self._columns, self._means = np.zeros((count, owned)), np.zeros((count, owned))  # a and b
        self._away = np.zeros(owned, dtype=bool)  # dofs that bodies do not reach

    @property
    def given(self) -> bool:
        """Whether a period has a rate."""
        return bool(self._axes)

    def begin_step(self) -> None:
        """Forget the forces of the last step, so that a resumed run starts alike."""
        self.values = np.zeros(len(self._axes))
        self._force.x.array[:] = 0.0

    def prescribe(self, t: float) -> None:
        """Set the rates to those at the time t [s]."""
        self._targets = self._given(t)

    def assemble(self, residuals: Sequence[Any], cut: Cut, weights: Weights, near: Mask) -> None:
        """Take a and b of a new cut, or of new scales of the stabilisation.

        residuals: forms over the cells, in which the force is linear; near: dofs that bodies reach. Raises StepFailed
        if bodies close a period.
        """
        grid = self._unknowns.grid
        if not all(leads_through(grid, cut, axis, self._unknowns.periodic) for axis in self._axes):
            reason = "bodies close a period, and leave no way for its 'rate'"
            raise StepFailed("fluid", FailureKind.NEWTON, reason)
        self._away = ~near
        functions = self._flow, self._history, self._force
        before = [function.x.array.copy() for function in functions]
        for function in functions:
            function.x.array[:] = 0.0
        without = self._rows(residuals)
        for number, axis in enumerate(self._axes):
            along = self._unknowns.velocity.dofs[:, axis]
            self._force.x.array[along] = 1.0
            self._columns[number] = without - self._rows(residuals)
            self._force.x.array[along] = 0.0
            self._means[number] = self._mean(axis, cut, weights)
        for function, values in zip(functions, before, strict=True):
            function.x.array[:] = values

    def _rows(self, residuals: Sequence[Any]) -> Array:
        out = np.zeros(self._unknowns.local)
        for form in residuals:
            fem.assemble_vector(form, out)
        fem.add_ghosts(self._unknowns.space, out)
        return out[: self._unknowns.owned]

    def _mean(self, axis: int, cut: Cut, weights: Weights) -> Array:
        """1/L int v_axis dx over the fluid for each shape function v."""
        unknowns, grid = self._unknowns, self._unknowns.grid
        uncut, cells = (some[some < grid.owned] for some in (cut.uncut, cut.cut))
        fluid = np.concatenate(
            [
                np.ones((len(uncut), len(weights.rule))),
                cut.fluid[: len(cut.cut)][cut.cut < grid.owned][:, weights.order],
            ]
        )
        cells = np.concatenate([uncut, cells])
        parts = grid.sizes[cells].prod(axis=1)[:, None] * ((fluid * weights.rule) @ weights.velocity_table[0])
        out = np.bincount(unknowns.cell_velocity[cells][:, :, axis].ravel(), parts.ravel(), unknowns.local).astype(
            float
        )
        fem.add_ghosts(unknowns.space, out)
        edge = grid.grid.edges[axis]
        return out[: unknowns.owned] / (edge[-1] - edge[0])

    # --------------------------------------------------------------------------------------------- the equations

    def rates(self, flow: Array) -> Array:
        """q [m^3/s] of values at owned dofs."""
        found: Array = self._comm.allreduce(self._means @ flow)
        return found

    def speeds(self, velocity: Array, t: float) -> tuple[Array, Array]:
        """Mean velocities [m/s] of the fluid along the periods: of the rates at the time t [s], and of a velocity."""
        return self._given(t) / self._sections(), self.rates(velocity) / self._sections()

    def eliminated(self, rows: Array, flow: Array, held: Mask) -> tuple[Array, Array]:
        """(rows with the forces that balance them and with the rates, the change of these forces [N/m^3]).

        rows: with the forces of `values`, zero at held dofs. Raises StepFailed.
        """
        if not self.given:
            return rows, self.values
        change = self._by_rows(held)(rows)
        missing = self._stiffness() * (self._targets - self.rates(flow))
        return rows - (change + missing) @ np.where(held, 0.0, self._columns), change

    def met(self, flow: Array) -> bool:
        """Whether the rates are those given, in half of the digits of their terms."""
        if not self.given:
            return True
        sizes = self._comm.allreduce(np.abs(self._means) @ np.abs(flow))
        return bool((np.abs(self._targets - self.rates(flow)) <= math.sqrt(EPS) * sizes).all())

    def take(self, change: Array) -> None:
        """Change the forces on the fluid."""
        self.values = self.values + change
        for axis, more in zip(self._axes, change, strict=True):
            self._force.x.array[self._unknowns.velocity.dofs[:, axis]] += more

    def slopes(self, matrix: PETSc.Mat, held: Mask) -> Array:
        """K^T w of a tangent K with rows of the identity at held dofs, shape (forces, owned)."""
        x, y = matrix.createVecs()
        found = np.zeros_like(self._columns)
        for number, test in enumerate(self._tests(held)):
            x.array[:] = test
            matrix.multTranspose(x, y)
            found[number] = y.array
        return found

    def product(self, held: Mask, slopes: Array) -> Callable[[Array], Array] | None:
        """The tangent less K, as a product with values at owned dofs; None without rates. slopes: K^T w."""
        if not self.given:
            return None
        columns, stiffness = np.where(held, 0.0, self._columns), self._stiffness()
        inverse = np.linalg.inv(self._moments(held))
        return lambda x: (stiffness * self.rates(x) - inverse @ self._comm.allreduce(slopes @ x)) @ columns

    def _stiffness(self) -> Array:
        """c [N/m^3 per m^3/s]."""
        terms, edges = self._terms, self._unknowns.grid.grid.edges
        slowest = sum((math.pi / (edge[-1] - edge[0])) ** 2 for edge in edges)
        mu = self._viscosity.where_it_shears(self._flow.x.array)
        inertia = float(terms.rho.value) * float(terms.alpha.value)
        return (inertia + mu * slowest) / self._sections()

    def _sections(self) -> Array:
        """Mean areas [m^2] of the fluid across the periods."""
        found: Array = self._comm.allreduce(self._means.sum(axis=1))
        return found

    def _given(self, t: float) -> Array:
        return np.array([evaluate(rate, np.zeros((3, 1)), t)[0] for rate in self._rates])

    def _tests(self, held: Mask) -> Array:
        """w: 1 at free velocities along the period, away from bodies if there are any."""
        found = np.zeros_like(self._columns)
        nodes = self._unknowns.velocity
        for test, axis in zip(found, self._axes, strict=True):
            dofs = nodes.dofs[: nodes.owned, axis]
            test[dofs] = (~held & self._away)[dofs]
            if self._comm.allreduce(float(test.sum())) == 0.0:
                test[dofs] = ~held[dofs]
        return found

    def _moments(self, held: Mask) -> Array:
        """w . a of all pairs. Raises StepFailed."""
        tests = self._tests(held)
        if (self._comm.allreduce(tests.sum(axis=1)) == 0.0).any():
            reason = "no node of the flow is free along a period with a 'rate': nothing flows there"
            raise StepFailed("fluid", FailureKind.NEWTON, reason)
        found: Array = self._comm.allreduce(tests @ self._columns.T)
        return found

    def _by_rows(self, held: Mask) -> Callable[[Array], Array]:
        moments, tests = self._moments(held), self._tests(held)
        return lambda rows: np.linalg.solve(moments, self._comm.allreduce(tests @ rows))
