"""The flow on its present cells: unknowns, equations and history, and their transfer to other cells."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy import sparse

from solvers.api import Array, State
from solvers.fluid.flow.behind import with_walls
from solvers.fluid.flow.carrier import Carrier
from solvers.fluid.flow.discretisation import Discretisation, discretise
from solvers.fluid.flow.flow_iterate import FlowIterate
from solvers.fluid.flow.history import History
from solvers.fluid.flow.moving_bodies import MovingBodies
from solvers.fluid.flow.thin_bodies import Began, Carrying
from solvers.fluid.geometry.thin.sheets import Sheets
from solvers.fluid.grid.box import Grid
from solvers.fluid.grid.following import Following, Surfaces, changed_nodes, interpolation
from solvers.fluid.grid.nested import Nested
from solvers.fluid.mesh.space import set_velocity
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.settings.time_scheme import FlowStep
from solvers.fluid.solve.linear_systems.krylov import FlowSolver, SolverSequence
from solvers.fluid.surfaces.surface import Motion
from solvers.fluid.terms.boundary.patches import Patch, driven_periods, outlet_laws
from solvers.fluid.terms.boundary.windkessel import Outlets
from solvers.mesh.distributed import scatter
from solvers.solver_settings import SolverSettings
from solvers.timing import Timer


class FlowOnCells:
    """Grid, unknowns, history and iterate. Calls are collective."""

    def __init__(
        self,
        comm: MPI.Comm,
        grid: Grid,
        moving: MovingBodies,
        settings: FlowSettings,
        patches: Sequence[Patch],
        solver: SolverSettings,
        *,
        timer: Timer,
        note: Callable[[str], None],
    ):
        """note: takes notes to the user."""
        self._comm, self._settings, self._patches, self._bodies = comm, settings, patches, moving.bodies
        self._solver, self._timer, self.box = solver, timer, grid
        self.parts: Discretisation = discretise(
            comm, grid, moving.sheets_at_start, settings, patches, moving.bodies, solver
        )
        self._sequence = SolverSequence(comm, self.parts.methods, self.parts.unknowns.counted(), note)
        self.iterate = self._first_iterate()
        self._outlets = Outlets(outlet_laws(patches))
        #: by the names of periods with a rate, the forces per volume that drive it [N/m^3]; nan before the first step
        self.driving_forces = {name: math.nan for name, *_ in driven_periods(patches)}
        self.history = History(settings.time, self.parts.unknowns.local)
        self.prescribed_at = 0.0  #: time [s] of the velocities of the boundary
        self.renewals = 1  #: count of discretisations: one, and one for each change of cells

    def _first_iterate(self) -> FlowIterate:
        parts, settings = self.parts, self._settings
        linear_tolerance = self._solver.linear_tolerance
        solver = FlowSolver(parts.unknowns, self._sequence, linear_tolerance, steady=settings.steady)
        return FlowIterate(parts.system, parts.levels, solver, linear_tolerance, self._timer)

    def _renew(self, sheets: Sheets | None) -> None:
        """Create grid, unknowns and equations anew."""
        gaps, settings = self.parts.system.gaps, self._settings
        self.parts = discretise(self._comm, self.box, sheets, settings, self._patches, self._bodies, self._solver)
        if gaps is not None and self.parts.system.gaps is not None:
            self.parts.system.gaps.memory = gaps.memory
        self.parts.system.outlets.lines = self._outlets.lines
        if self.parts.methods != self._sequence.methods:
            self._sequence = self._sequence.replaced(self.parts.methods, self.parts.unknowns.counted())
        self.iterate, self.renewals = self._first_iterate(), self.renewals + 1

    @property
    def flow(self) -> Array:
        """Velocity [m/s] and pressure [Pa] at local dofs (a view)."""
        return self.parts.system.flow.x.array

    def velocity(self) -> Array:
        """Velocity [m/s] at local dofs, zero at those of the pressure."""
        return np.where(self.parts.unknowns.velocity_mask, self.flow, 0.0)

    def pressure(self) -> Array:
        """Pressure [Pa] at local dofs, zero where it is no unknown."""
        return np.where(self.parts.system.active_dofs & ~self.parts.unknowns.velocity_mask, self.flow, 0.0)

    # ------------------------------------------------------------------------------------------------------- a step

    def initialise(self, t: float) -> None:
        """Set the initial velocity at time t [s]."""
        if self._settings.initial_velocity is not None:
            set_velocity(self.flow, self.parts.unknowns.velocity, self._settings.initial_velocity, t)
            self.parts.unknowns.share(self.parts.system.flow)
        self.history.start(self.velocity())

    def begin_step(self) -> None:
        """Begin a step from the history; what is left of the last step is discarded."""
        if self.parts.behind is not None:  # the first iterate is the history, which is bounded behind walls
            mask = self.parts.unknowns.velocity_mask
            self.flow[mask] = self.history.past[0].velocity[mask]
        self.history.begin_step(self.pressure())
        self.parts.cutter.begin_step()
        self.iterate.begin_step()

    def begin_system(self, step: FlowStep, slip_rate: Array | None) -> None:
        """Set loads and history terms of a step; slip_rate: see `SlipHistory.rate`."""
        system, rule, last = self.parts.system, step.difference, self.history.past[0].velocity
        system.slip_rate = slip_rate
        self._outlets.begin_step(None if self._settings.steady else step.dt)
        system.outlets.lines = self._outlets.lines
        system.begin_step(step, self.history.rate(rule), self.history.missing(rule), last)

    def prescribe(self, t: float) -> None:
        """Set velocities of the boundary and rates to those at time t [s], until the next step begins."""
        self.prescribed_at = t
        self.flow[self.parts.boundary.dofs] = self.parts.boundary.velocity(t)
        self.parts.system.driving.prescribe(t)

    def predict(self, dt: float, *, with_pressure: bool) -> None:
        """Predictor for a step of length dt [s], see `Fluid.predict`."""
        self.iterate.begin_guess()
        if not self._settings.steady:
            with_pressure &= self._settings.degree == 1
            self.history.extrapolate(self.flow, dt, self.parts.boundary.dofs, with_pressure=with_pressure)
        self.iterate.end_guess()

    def end_step(self, dt: float, wet: NDArray[np.bool_]) -> None:
        """Accept a step of length dt [s]; wet: mask of the facets that the fluid acts on."""
        system = self.parts.system
        assert system.cut is not None
        self._outlets.end_step(system.outlets.rates(self.iterate.values()).tolist())
        self.driving_forces = dict(zip(self.driving_forces, system.driving.values.tolist(), strict=True))
        system.end_step()
        found = system.active_dofs | system.dofs_of(system.cut.contact_cells)
        velocity = self.velocity()
        if self.parts.behind is not None:
            velocity = self.parts.behind.bounded(velocity, system.cut, wet)
        velocity = with_walls(velocity, self.parts.unknowns, system.cut, found & ~system.active_dofs)
        self.history.end_step(dt, velocity, found, self.pressure())

    def continue_back(self, dt: float, short: float) -> None:
        """Restore the initial velocity after a step of length `short`; see `History.continue_back`."""
        found, start = self.parts.system.active_dofs.copy(), self.history.past[0].velocity
        self.history.continue_back(dt, np.where(found, self.velocity() - start, 0.0) / short, found)
        mask = self.parts.unknowns.velocity_mask
        self.flow[mask] = start[mask]

    # ------------------------------------------------------------------------------------------------- other cells

    def take_sheets(self, sheets: Sheets, facets: NDArray[np.int64], motion: Motion, began: Began | None) -> bool:
        """Take other sheets around the present facets; returns whether they have other unknowns.

        Then the iterate is carried over from the last iterate, and the history from the state at the beginning of the
        step, so that it does not depend on the iterates in between.
        """
        now, old, flow, iterate = self.parts.grid.sheets, self.parts.unknowns, self.flow, self.iterate
        if now is not None and now.same_unknowns(sheets):
            self.parts.grid.sheets = sheets
            return False
        self._renew(sheets)
        carry = Carrying(self.parts.unknowns, facets, motion)
        carrier = carry(old, now)
        self.flow[:] = carrier.flow(flow)
        self.iterate.carry(iterate, carrier)
        if began is not None and began.unknowns is not old:
            carrier = carry(began.unknowns, began.sheets)
        past = self.history.past if began is None else began.past
        self.history.replace([carrier.past(one) for one in past], np.zeros(self.parts.unknowns.local))
        return True

    def follow_bodies(self, following: Following, ways: Surfaces) -> NDArray[np.int64] | None:
        """Take other nested cells if bodies come close to coarse ones on their ways.

        Returns the numbers of the nodes of the pressure whose equations changed; None: the cells stay.
        """
        before, old, flow, history = self.box, self.parts.unknowns, self.flow, self.history
        sheets = self.parts.grid.sheets
        assert isinstance(before, Nested)
        cells = following.cells(before, ways)
        if cells is before:
            return None
        matrices = []
        for degree in (self._settings.degree, 1):
            matrix = interpolation(before, cells, degree)
            if sheets is not None:  # nodes of the sheets are far from the cells that change
                further = sheets.node_count(degree) - sheets.lattice_size(degree)
                matrix = sparse.block_diag([matrix, sparse.identity(further)], format="csr")
            matrices.append(matrix)
        self.box = cells
        self._renew(sheets)
        carrier = Carrier(old, self.parts.unknowns, *matrices)
        self.flow[:] = carrier.flow(flow)
        history.replace([carrier.past(past) for past in history.past], carrier.flow(history.pressure_change))
        return changed_nodes(before, cells)

    # ---------------------------------------------------------------------------------------------- save and restore

    def save(self) -> State:
        nested = {"first": self.box.first, "width": self.box.width} if isinstance(self.box, Nested) else {}
        closed = np.unique(np.concatenate(self._comm.allgather(np.flatnonzero(self.parts.cutter.closed))))
        state = self.history.save(self.parts.unknowns) | self.parts.system.save()
        state |= {"nested": nested, "closed": closed, "outlets": self._outlets.save()}
        state |= {"driving_forces": self.driving_forces}
        return state | {"linear_solver": self._sequence.position}

    def restore_cells(self, state: State, sheets: Sheets | None, *, follow: bool) -> None:
        """Take the cells of a saved state; follow: nested ones may be others."""
        if follow:
            nested = self._comm.bcast(state["nested"], root=0)
            self.box = Nested(self.box.edges, np.asarray(nested["first"]), np.asarray(nested["width"]))
        if sheets is not self.parts.grid.sheets or follow:
            self._renew(sheets)
            self.history = History(self._settings.time, self.parts.unknowns.local)

    def restore(self, state: State, *, gathered: bool) -> None:
        """Restore a saved state on its cells; gathered: its arrays are whole."""
        own = scatter(self._comm, state, self.save()) if gathered else state
        self.history.restore(self.parts.unknowns, own)
        self.parts.system.restore(own)
        self._outlets.restore(own["outlets"])
        self.driving_forces = {name: own["driving_forces"].get(name, math.nan) for name in self.driving_forces}
        self._sequence.position = own["linear_solver"]
        self.parts.cutter.restore(own["closed"])
