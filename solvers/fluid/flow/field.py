"""The field `Fluid`: incompressible flow on a fixed grid, cut by surfaces of bodies at rest or in motion.

A time step is `begin_step` (boundary values, loads, history), `move` (cut of the grid by the surfaces), `solve`
(Newton's method on the equations of `FlowSystem`) and `end_step` (the velocity becomes history). A coupled scheme takes
the place of `solve`: it calls `move`, `residual`, `linearise` and `update` for each of its iterates.

Its state is in two objects, and nothing else changes them: `on_cells` (grid, unknowns, equations, history, iterate of
Newton's method) and `moving` (bodies and their motion).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array, Indices, State, StepInfo
from solvers.fluid.cut.cut import Cut
from solvers.fluid.flow import reach
from solvers.fluid.flow.balances import Balances
from solvers.fluid.flow.change_of_forces import ChangeOfForces
from solvers.fluid.flow.discretisation import Discretisation
from solvers.fluid.flow.flow_iterate import FlowIterate
from solvers.fluid.flow.history import History
from solvers.fluid.flow.moving_bodies import MovingBodies
from solvers.fluid.flow.on_cells import FlowOnCells
from solvers.fluid.flow.thin_bodies import Began
from solvers.fluid.geometry.thin.fluid_parts import LAYERS_AROUND
from solvers.fluid.grid.box import Grid
from solvers.fluid.grid.following import Following
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.settings.time_scheme import STEADY, Difference, FlowStep
from solvers.fluid.solve.linear_systems.krylov import FlowSolver
from solvers.fluid.solve.steady_iteration import SteadyIteration
from solvers.fluid.solve.system import FlowSystem
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import Motion
from solvers.fluid.terms.boundary.patches import Patch, periodic_axes
from solvers.fluid.terms.coupling_entries import InterfaceEntries
from solvers.mesh.distributed import everywhere
from solvers.newton import Smooth, converge
from solvers.solver_settings import SolverSettings
from solvers.timing import Timer


class Fluid(Smooth):
    """Implements `Field`: velocity and pressure on the cut grid, from step to step."""

    name = "fluid"
    can_start, divides = True, False  #: in the middle of a run; its steps there

    def __init__(
        self,
        grid: Grid,
        settings: FlowSettings,
        patches: Sequence[Patch],
        bodies: Sequence[ImmersedBody] = (),
        solver: SolverSettings = SolverSettings(),
        *,
        following: Following | None = None,
        timer: Timer | None = None,
        comm: MPI.Comm = MPI.COMM_WORLD,
    ):
        """following: how nested cells follow bodies; None: they stay."""
        self.comm, self.settings, self.solver, self.timer = comm, settings, solver, timer or Timer()
        self.dim, self.patches, self.following = grid.dim, patches, following
        self.steady, self.scheme = settings.steady, settings.time  #: steps are steady states; the time scheme
        self.times = settings.time.times  #: largest count of earlier velocities in its difference formulas
        self.smallest_cell = min(float(np.diff(edge).min()) for edge in grid.edges)
        self.notes: list[str] = []  #: notes to the user on this step
        self.moving = MovingBodies(grid, bodies, settings, periodic_axes(patches))
        timer, note = self.timer, self.notes.append
        self.on_cells = FlowOnCells(comm, grid, self.moving, settings, patches, solver, timer=timer, note=note)
        self._balances: Balances | None = None
        self.current = FlowStep(0.0, 0.0, STEADY)  #: the step that is computed now or was last
        self.began: Began | None = None  #: state at the beginning of the present step
        #: Newton's method has made an increment in this step. Before the first one, the pressure of films belongs to
        #: their last height; the derivative in `film_shape` is proportional to it, and would move surfaces too far.
        self._improved = False
        self.started = False  #: a step was accepted, hence forces exist
        self._iterations_of_step = 0  #: of all linear systems of this step
        self.steady_iteration = SteadyIteration()
        self._change = ChangeOfForces(settings)

    # ------------------------------------------------------------------------------------------------- the parts

    @property
    def parts(self) -> Discretisation:
        return self.on_cells.parts

    @property
    def renewals(self) -> int:
        """Count of discretisations: one, and one for each change of cells."""
        return self.on_cells.renewals

    @property
    def history(self) -> History:
        return self.on_cells.history

    @property
    def iterate(self) -> FlowIterate:
        return self.on_cells.iterate

    @property
    def grid(self) -> DistributedGrid:
        return self.parts.grid

    @property
    def unknowns(self) -> Unknowns:
        return self.parts.unknowns

    @property
    def system(self) -> FlowSystem:
        return self.parts.system

    @property
    def size(self) -> int:
        """Unknowns that this process owns."""
        return self.unknowns.owned

    def dofs(self) -> int:
        """Unknowns on all processes, inactive ones included (collective)."""
        return self.unknowns.counted()

    @property
    def flow(self) -> Array:
        """Velocity [m/s] and pressure [Pa] at local dofs (a view)."""
        return self.on_cells.flow

    @property
    def cut(self) -> Cut:
        assert self.system.cut is not None
        return self.system.cut

    @property
    def bodies(self) -> list[ImmersedBody]:
        return self.moving.bodies

    def velocity(self) -> Array:
        """Velocity [m/s] at local dofs, zero at those of the pressure."""
        return self.on_cells.velocity()

    @property
    def difference(self) -> Difference:
        """The formula of the present step."""
        return self.current.difference

    @property
    def longest_step(self) -> float:
        """[s]; longer ones would be too much longer than the last one for the rule."""
        return self.history.longest_step

    @property
    def far(self) -> bool:
        """Whether a steady flow is too far from the solution for Newton's method."""
        return self.steady and self.steady_iteration.far

    @property
    def iterative(self) -> FlowIterate:
        """Its iterative solvers."""
        return self.iterate

    # ------------------------------------------------------------------------------------------------- steps

    def initialise(self, t: float, dt: float) -> None:
        """Set the initial velocity at time t [s]; dt [s]: the first step."""
        self.on_cells.initialise(t)
        self.current = FlowStep(t, dt, self.history.difference(dt))
        if not self.moving.coupled:
            self.move({})

    def start_anew(self, t: float, dt: float) -> None:
        """Let the next steps count no velocity from before t, where given ones jump."""
        self.history.forget_earlier()

    def step(self, t: float, dt: float) -> StepInfo:
        """One step from t to t + dt. Raises StepFailed."""
        self.begin_step(t, dt)
        info = self.solve()
        self.end_step()
        return info

    def begin_step(self, t: float, dt: float) -> None:
        """Store the state at t; set boundary values, loads and moving bodies at t + dt. Times in [s]."""
        if self.following is not None:
            changed = self.on_cells.follow_bodies(self.following, self.moving.ways(t, dt))
            if changed is not None:
                self._restore_continuity(changed, t, dt)
        self.current = FlowStep(t + dt, dt, self.history.difference(dt), self.history.scale_alpha(dt))
        self.on_cells.begin_step()
        layers, past = 0 if self.system.cut is None else self.cut.depth, tuple(self.history.past)
        self.began = Began(self.unknowns, self.grid.sheets, self.current, past, tuple(self.moving.motions), layers)
        self.moving.begin_step()
        self._begin_system(self.current)
        self.on_cells.prescribe(self.current.t)
        self.steady_iteration.begin()
        self._improved = False
        self.notes.clear()
        self._iterations_of_step = 0
        if not self.moving.coupled:
            self.predict()
            self.move({})

    def _begin_system(self, step: FlowStep) -> None:
        """Set loads and history terms of the step."""
        self._change.begin()
        self.on_cells.begin_system(step, self.moving.slip.rate(step.difference))

    def predict(self, *, with_pressure: bool = False) -> None:
        """Predictor: extrapolate the velocity linearly from the last two steps, where both have one.

        with_pressure: the pressure, too, for first degree. With second degree, that of films follows their height.
        """
        self.on_cells.predict(self.current.dt, with_pressure=with_pressure)

    def solve(self) -> StepInfo:
        """Newton's method to the tolerance. Raises StepFailed."""
        self.steady_iteration.begin()
        self._change.begin()
        info = converge(self, self.solver.newton)
        self.iterate.keep_levels()
        if not self.moving.coupled:
            self.notes += self.moving.notes(self.current)
        numbers = {**info.numbers, "fluid.linear": float(self._iterations_of_step)}
        return replace(info, numbers=numbers, notes=tuple(self.notes))

    def end_step(self) -> None:
        """Accept the step. Cells between surfaces in contact get the velocity zero."""
        if self.moving.coupled:
            self.notes += self.moving.notes(self.current)
        if self.bodies and not self.steady:
            self.moving.slip.end_step(self.system.slip())
        self.on_cells.end_step(self.current.dt, self.moving.surfaces.wet)
        self.forget_step()
        self.started = True

    def forget_step(self) -> None:
        """Let the next step start from the present history."""
        self.began = None

    # -------------------------------------------------------------------------------------- surfaces and cells

    def outside(self, surfaces: Mapping[str, Motion]) -> set[str]:
        """Names of the surfaces that lie outside of the box, which have nothing to do with the flow."""
        return self.moving.outside(surfaces)

    def has_films(self) -> bool:
        """Whether the present cut has films thinner than a cell, or bodies touch that may leave one (collective)."""
        touching = self.grid.sheets is not None and len(self.grid.sheets.touching) > 0
        return bool(self.comm.allreduce(touching or self.cut.film is not None, op=MPI.LOR))

    def release(self) -> bool:
        """Let parts of the fluid go that cycles of iterates join; whether the unknowns are others without them."""
        return self.moving.release()

    def move(self, coupled: Mapping[str, Motion], *, with_solid: bool = False) -> None:
        """Cut the grid by the surfaces at their present positions, and set what depends on the cut (collective).

        coupled: motions of the bodies that another field moves, by name; the others move as prescribed.
        with_solid: the system has the equations of these bodies, too, which determine the pressure of closed pockets.
        Raises StepFailed if surfaces have moved too far in this step, or are close to coarse cells or periodic faces.
        """
        with self.timer("cut"):
            facets, motion = self.moving.move(coupled, self.current.t)
            self._follow_sheets(facets, motion)
            cut = self._cut(facets, motion)
        with self.timer("weights"):
            self.system.set_cut(cut)
            self.system.sweep_velocity = self.moving.sweep.velocity(facets, motion.x, motion.v, self.difference)
            reach.require_history(self, cut, self.history.missing(self.difference))
            self.flow[~self.system.active_dofs] = 0.0
            if self.unknowns.hanging is not None:
                self.unknowns.share(self.system.flow)
            self.iterate.hold(set_by_solids=with_solid and not self.steady)

    def _cut(self, facets: NDArray[np.int64], motion: Motion) -> Cut:
        cutter, surfaces = self.parts.cutter, self.moving.surfaces
        if self.steady and self.steady_iteration.scales_follow:
            # roots belong to the final position of the bodies, not to the initial one
            cutter.forget()
            self.system.forget_roots()
        wet = surfaces.wet_in_unions if cutter.unions or self.grid.sheets is not None else surfaces.wet
        layers = 0  # of cells behind the surface that the next steps may uncover; none around thin bodies
        if not (self.moving.thin.follows or self.steady or self.moving.rest):
            layers = reach.strip_layers(self.grid, motion, self.times * self.current.dt, self.smallest_cell)
        cut = cutter(facets, motion, layers, wet)
        reach.require_finest(cutter, self.comm)
        return cut

    def _follow_sheets(self, facets: NDArray[np.int64], motion: Motion) -> None:
        """Take the sheets that belong to the present facets (collective).

        Raises StepFailed if a body has moved too far in a step of an unsteady flow; a steady one has no history.
        """
        sheets, began = self.moving.thin.sheets(facets, motion), self.began
        if sheets is self.grid.sheets:
            return
        assert sheets is not None
        if began is not None and not self.steady and began.way(motion.x) > LAYERS_AROUND * self.smallest_cell:
            raise reach.moved_too_far(self, LAYERS_AROUND)
        if self.on_cells.take_sheets(sheets, facets, motion, began) and began is not None:
            self._begin_system(began.step)
            self.on_cells.prescribe(self.on_cells.prescribed_at)

    def _restore_continuity(self, changed: NDArray[np.int64], t: float, dt: float) -> None:
        """Correct the velocities of the past on other cells, see `grid.following` (collective).

        changed: numbers of the nodes of the pressure whose equations changed.
        """
        flow, history, mask = self.flow.copy(), self.history, self.unknowns.velocity_mask
        last, earlier = history.past[0], history.past[1 if history.steps else 0]
        rate = (last.velocity - earlier.velocity) / (history.steps[0] if history.steps else dt)
        self.current = step = FlowStep(t, dt, history.difference(dt), history.scale_alpha(dt))
        self.on_cells.prescribe(t)
        self.move(self.moving.by_others())
        middle = 0.5 * (last.velocity + earlier.velocity)
        self.flow[:] = np.where(mask, middle, flow - 0.5 * history.pressure_change)
        self.system.begin_step(step, step.difference.alpha * middle - rate, ~last.found, last.velocity)
        self.follow()
        self.residual()
        nodes = self.unknowns.pressure
        self.iterate.keep_rows(nodes.dofs[: nodes.owned, 0][np.isin(nodes.numbers[: nodes.owned], changed)])
        self._advance(self.iterate.solver.for_sources(), keep=False)
        correction = np.where(self.system.active_dofs & mask, self.flow - middle, 0.0)
        history.correct(correction)
        self.flow[:] = flow + correction

    # ------------------------------------------------------------------------------------ the start of a coupled flow

    def begin_start_step(self, t: float, short: float, difference: Difference) -> None:
        """Begin a short step [s] with positions and loads of t; velocities of the boundary are those at its end."""
        self.begin_step(t - short, short)
        self._begin_system(replace(self.current, scale_alpha=None))  # that of other steps is not its own
        self.moving.sweep.forget()  # nothing moves
        self.on_cells.prescribe(t + short)
        self.current = FlowStep(t, short, difference)

    def end_start(self, dt: float, short: float, before: Sequence[Mapping[str, Motion]]) -> None:
        """Restore the initial velocity, and extrapolate those before it, in steps dt [s], by the rate of the last step.

        short: its length [s]; before: motions of coupled surfaces at the times before the start, newest first.
        """
        self.moving.continue_back(self.current.t, dt, short, before)
        self.on_cells.continue_back(dt, short)
        self.current = FlowStep(self.current.t, dt, self.history.difference(dt))

    def end_impulse(self, dt: float) -> None:
        """Take the velocity of the last start step for the initial one; dt [s]: length of the first step."""
        self.history.start(self.on_cells.velocity(), self.system.active_dofs.copy())
        self.moving.slip.start(self.system.slip())
        self.current = FlowStep(self.current.t, dt, self.history.difference(dt))

    # ---------------------------------------------------------------------------- the system that Newton solves

    def follow(self) -> None:
        """Set the scales of the stabilisation of a steady flow to the iterate while they follow it (collective)."""
        if self.steady and self.steady_iteration.scales_follow:
            with self.timer("assembly"):
                self.system.set_scales(self.on_cells.velocity())

    def residual(self) -> Array:
        """Norm [N] of the momentum rows and of the continuity rows times the impedance of a cell, shape (1,)."""
        size = self._norm(self.iterate.residual())
        self._change.record(size, self.iterate, self._norm)
        self.steady_iteration.record(size, self._change.size)
        return np.array([size])

    def forces(self) -> Array:
        """Norm [N] of the change of forces, shape (1,)."""
        return np.array([self._change.size])

    def _norm(self, rows: Array) -> float:
        return self.iterate.norm(rows, self.smallest_cell, self.difference.alpha)

    @property
    def _picard(self) -> bool:
        """Whether the tangent is that of Picard's method."""
        return bool(self.settings.convection and self.far)

    def advance(self, *, keep: bool = False, reduction: float = 0.0) -> Array:
        """One iteration of Newton's method; returns the increment relative to the solution. Raises StepFailed.

        keep: use the tangent of the last iterate if the same unknowns are held and the flow is unsteady.
        """
        return self._advance(self.iterate.solver, keep=keep and self.keeps_tangent(), reduction=reduction)

    def _advance(self, solver: FlowSolver, *, keep: bool, reduction: float = 0.0) -> Array:
        increment = self.iterate.solve(solver, keep=keep, picard=self._picard, reduction=reduction)
        self._iterations_of_step += self.iterate.linear_iterations
        return self.update(increment)

    def keeps_tangent(self) -> bool:
        """Whether the last tangent has its rows of the identity where this iterate has them (collective)."""
        return self.comm.allreduce(self.iterate.keeps_tangent(), op=MPI.LAND) and not self.steady

    def linearise(self) -> PETSc.Mat:
        """The tangent at the present iterate; held rows are those of the identity. The next call overwrites it."""
        return self.iterate.linearise(picard=self._picard)

    def added_product(self) -> Callable[[Array], Array] | None:
        """The part of the tangent that couples all of an outlet, as a product with owned values; None: nothing."""
        return self.iterate.added_product()

    def right_side(self) -> Array:
        """Right-hand side for the increment of owned dofs: minus the residual."""
        return -self.iterate.rows

    def rounded(self) -> Array:
        """The values whose rounding enters the residual: velocity [m/s] and pressure [Pa] at owned dofs."""
        return self.iterate.values()

    def update(self, increment: Array) -> Array:
        """Add an increment of the owned dofs; returns its norm relative to that of the flow, shape (1,)."""
        self._improved = True
        change, solution = (self._norm(rows) for rows in self.iterate.add(increment))
        return np.array([change / solution if solution > 0.0 else 0.0])

    def retreat(self, fraction: Array) -> None:
        """Take back a fraction of the last increment, shape (1,)."""
        self.iterate.retreat(float(fraction[0]))

    def linked(self) -> Indices:
        """One part."""
        return np.zeros(1, dtype=np.int64)

    def add_rounding(self, error: Array) -> None:
        """Add rounding errors at owned dofs that another field causes in these equations; call it after `linearise`."""
        self.iterate.add_rounding(error)

    def only_rounding(self) -> NDArray[np.bool_]:
        """Whether the norm of the residual is that of rounding errors, where this step linearised last, shape (1,)."""
        rounding = self._norm(self.iterate.rounding(picard=self._picard))
        return np.array([self.system.driving.met(self.iterate.values()) and self._norm(self.iterate.rows) <= rounding])

    def worst(self) -> tuple[float, ...] | None:
        """Position [m] of the node with the largest momentum residual (collective)."""
        return self.iterate.worst()

    # ---------------------------------------------------------------------------------------------- reactions

    def squeezed(self) -> Array:
        """Mean distance [m] by which elastic bodies squeeze each closed pocket in this step, after `solve`."""
        return self.current.dt * self.parts.levels.squeezed()

    def add_levels(self, distance: Array) -> None:
        """Add the pressure that accelerates a cell of fluid by a distance [m] to the level of each such pocket."""
        self.parts.levels.add(self.settings.density * self.smallest_cell / self.current.dt**2 * distance)

    def suction(self) -> float:
        """Largest pressure below zero [Pa] around bodies whose closed contact is dry (collective)."""
        return self.system.suction(self.moving.dry_in_contact())

    def force(self) -> dict[str, Array]:
        """Force [N] (per depth in 2D) of the fluid on the vertices of each body, shape (n, dim) (collective)."""
        return self.moving.surfaces.by_name(self.system.surface_force())

    def interface_entries(self, surfaces: Sequence[str]) -> InterfaceEntries:
        """Derivatives of rows and force by the motion of some bodies (collective)."""
        cut, rule, vertices = self.cut, self.difference, self.moving.surfaces.vertices_of(surfaces)
        swept = self.moving.sweep.by_motion(cut.facets, cut.motion.x, cut.motion.v, rule)
        return self.system.interface_entries(self.iterate.held, vertices, rule.alpha, swept, improved=self._improved)

    def balances(self) -> tuple[Array, float, float]:
        """(force [N] on all bodies by the balance of momentum, (dim,); power [W] lost by the method, of patches)."""
        if self._balances is None or self._balances.system is not self.system:
            self._balances = Balances(self.system)
        return self._balances(self.iterate.held)

    def unsolved(self) -> tuple[float, float]:
        """Sums of |residual|: of the momentum [N] and of the continuity equations [m^3/s] (collective)."""
        return self.iterate.unsolved()

    # ---------------------------------------------------------------------------------------- save and restore

    @property
    def _cells_may_change(self) -> bool:
        return self.moving.thin.may_follow or self.following is not None

    def save(self) -> State:
        """The state that a next step starts from; whole arrays where cells may change, by process else (collective)."""
        state = self.on_cells.save() | self.moving.save() | {"time": self.current.t}
        return everywhere(self.comm, state) if self._cells_may_change else state

    def restore(self, state: State) -> None:
        """Restore a saved state (collective)."""
        self.forget_step()
        self.moving.restore(state)
        self.on_cells.restore_cells(state, self.moving.sheets(), follow=self.following is not None)
        self.on_cells.restore(state, gathered=self._cells_may_change)
        self.current = FlowStep(state["time"], 0.0, STEADY)
        flow = self.flow.copy()
        self.move(self.moving.by_others())
        self.flow[:] = flow
        self.system.sweep_velocity = state["sweep_velocity"] if len(state["sweep_velocity"]) else None
