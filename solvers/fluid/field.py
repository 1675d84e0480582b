"""The field `Fluid`: incompressible flow on a fixed grid, cut by surfaces of bodies at rest or in motion.

A time step is `begin_step` (boundary values, loads, history), `move` (cut of the grid by the surfaces), `solve`
(Newton's method on the equations of `FlowSystem`) and `end_step` (the velocity becomes history). A coupled scheme takes
the place of `solve`: it calls `move`, `residual`, `linearise` and `update` for each of its iterates.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem, linear
from solvers.api import Array, State, StepFailed, StepInfo
from solvers.fluid.background.following import Following
from solvers.fluid.background.grid import Grid
from solvers.fluid.background.space import set_velocity
from solvers.fluid.balances import Balances
from solvers.fluid.bodies.all_surfaces import AllSurfaces
from solvers.fluid.bodies.fast_bodies import FastBodies
from solvers.fluid.bodies.immersed import ImmersedBody, sheets_of
from solvers.fluid.bodies.surface import Motion
from solvers.fluid.bodies.sweep import Sweep
from solvers.fluid.boundary.patches import Patch, periodic_axes
from solvers.fluid.closed_contact.zone_entries import with_zone
from solvers.fluid.coupling_entries import InterfaceEntries, interface_entries
from solvers.fluid.cutting.cut import Cut
from solvers.fluid.discretisation import discretise
from solvers.fluid.flow_settings import FlowSettings
from solvers.fluid.follow_surfaces import follow_surfaces
from solvers.fluid.history import History
from solvers.fluid.kept_tangent import KeptTangent
from solvers.fluid.linear_systems.krylov import FlowSolver, SolverSequence
from solvers.fluid.regrid import follow_bodies
from solvers.fluid.saved import restore_state, saved_state
from solvers.fluid.steady_iteration import SteadyIteration
from solvers.fluid.system import FlowSystem
from solvers.fluid.thin.sheets import Sheets
from solvers.fluid.thin.thin_bodies import Began, ThinBodies
from solvers.fluid.time_scheme import STEADY, FlowStep
from solvers.largest import position_of_largest
from solvers.newton import converge
from solvers.solver_settings import SolverSettings
from solvers.timing import Timer


class Fluid:
    """Implements `Field`: velocity and pressure on the cut grid, from step to step."""

    name = "fluid"
    system: FlowSystem  #: the equations on the present grid

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
        self.bodies, self.dim, self.box, self.patches = list(bodies), grid.dim, grid, patches
        self.following = following
        periodic = bool(periodic_axes(patches))
        sheets = None if periodic else sheets_of(grid, self.bodies)
        self.thin = ThinBodies(grid, self.bodies, periodic, sheets)
        self.steady, self.scheme = settings.steady, settings.time  #: steps are steady states; the time scheme
        self.linear_tolerance = solver.linear_tolerance
        self.notes: list[str] = []  #: notes to the user on this step
        self.renewals = 0  #: count of discretisations: one, and one for each change of cells
        self.discretise(sheets)
        self.history = History(settings.time, self.unknowns.local)
        self.current = FlowStep(0.0, 0.0, STEADY)  #: the step that is computed now or was last
        self.began: Began | None = None  #: state at the beginning of the present step
        #: Newton's method has made an increment in this step. Before the first one, the pressure of films belongs to
        #: their last height; the derivative in `film_shape` is proportional to it, and would move surfaces too far.
        self._improved = False
        self.prescribed_at = 0.0  #: time [s] of the velocities of the boundary
        self.started = False  #: a step was accepted, hence forces exist
        self.smallest_cell = min(float(np.diff(edge).min()) for edge in grid.edges)
        self.motions: list[Motion] = []
        self.surfaces = AllSurfaces([body.surface for body in self.bodies], self.dim)
        sweep = [np.full(len(b.surface.facets), b.sweeps) for b in self.bodies]
        self.sweep = Sweep(settings.time.times, np.concatenate([*sweep, np.empty(0, dtype=bool)]))
        self._fast_bodies = FastBodies(grid)
        self.linear_iterations = 0  #: of the last linear system
        self._iterations_of_step = 0  #: of all linear systems of this step
        self.steady_iteration = SteadyIteration()
        self._first = 0.0  #: residual of the first iterate [N]
        self._share = 1.0  #: of the last increment that the iterate has

    def discretise(self, sheets: Sheets | None) -> None:
        """Create grid, unknowns and equations; sheets: separate cells on each side of thin bodies, None: none."""
        settings = self.settings
        in_gaps = self.system.gaps if self.renewals else None
        parts = discretise(self.comm, self.box, sheets, settings, self.patches, self.bodies, self.solver)
        self.grid, self.unknowns, self.boundary = parts.grid, parts.unknowns, parts.boundary
        self.system, self.cutter, self.levels, self._behind = parts.system, parts.cutter, parts.levels, parts.behind
        if in_gaps is not None and self.system.gaps is not None:
            self.system.gaps.memory = in_gaps.memory
        self.size = owned = self.unknowns.owned  #: unknowns that this process owns
        if not self.renewals:
            self.sequence: SolverSequence = SolverSequence(self.comm, parts.methods, self.dofs(), self.notes.append)
        elif parts.methods != self.sequence.methods:
            self.sequence = self.sequence.replaced(parts.methods, self.dofs())
        self.linear_solver = FlowSolver(self.unknowns, self.sequence, self.linear_tolerance, steady=settings.steady)
        self._tangent = KeptTangent(self.system)
        self.held = np.zeros(owned, dtype=bool)  #: owned dofs with rows of the identity
        self.residual_rows, self.increment = np.zeros(owned), np.zeros(owned)
        self.before = np.zeros(owned)  #: flow before the last increment
        self._balances: Balances | None = None
        self.renewals += 1

    # ------------------------------------------------------------------------------------------------- the state

    def dofs(self) -> int:
        """Unknowns on all processes, inactive ones included (collective)."""
        return self.unknowns.counted()

    @property
    def flow(self) -> Array:
        """Velocity [m/s] and pressure [Pa] at local dofs (a view)."""
        return self.system.flow.x.array

    @property
    def cut(self) -> Cut:
        assert self.system.cut is not None
        return self.system.cut

    def velocity(self) -> Array:
        """Velocity [m/s] at local dofs, zero at those of the pressure."""
        return np.where(self.unknowns.velocity_mask, self.flow, 0.0)

    def initialise(self, t: float, dt: float) -> None:
        """Set the initial velocity at time t [s]; dt [s]: the first step."""
        if self.settings.initial_velocity is not None:
            set_velocity(self.flow, self.unknowns.velocity, self.settings.initial_velocity, t)
            self.unknowns.share(self.system.flow)
        self.history.start(self.velocity())
        self.current = FlowStep(t, dt, self.history.difference(dt))
        if not self._coupled:
            self.move({})

    @property
    def _coupled(self) -> bool:
        """Another field moves some of the bodies."""
        return any(body.motion is None for body in self.bodies)

    # ------------------------------------------------------------------------------------------------- steps

    def step(self, t: float, dt: float) -> StepInfo:
        """One step from t to t + dt. Raises StepFailed."""
        self.begin_step(t, dt)
        info = self.solve()
        self.end_step()
        return info

    def begin_step(self, t: float, dt: float) -> None:
        """Store the state at t; set boundary values, loads and moving bodies at t + dt. Times in [s]."""
        if self.following is not None:
            follow_bodies(self, self.following, t, dt)
        self.current = FlowStep(t + dt, dt, self.history.difference(dt), self.history.scale_alpha(dt))
        if self._behind is not None:  # the first iterate is the history, which is bounded behind walls
            mask = self.unknowns.velocity_mask
            self.flow[mask] = self.history.past[0].velocity[mask]
        self.history.begin_step(self._present_pressure())
        history = tuple(self.history.past)
        layers = 0 if self.system.cut is None else self.system.cut.depth
        self.began = Began(self.unknowns, self.grid.sheets, self.current, history, tuple(self.motions), layers)
        self.sweep.begin_step(self.surfaces.together(self.motions)[1].x)
        self.thin.begin_step()
        self.surfaces.begin_step()
        self.cutter.begin_step()
        self.begin_system(self.current)
        self.prescribe(self.current.t)
        self.steady_iteration.begin()
        self._improved = False
        self._tangent.begin_step()
        self.linear_solver.begin_step()
        self.notes.clear()
        self._iterations_of_step = 0
        if not self._coupled:
            self.predict()
            self.move({})

    def begin_system(self, step: FlowStep) -> None:
        """Set loads and history terms of the step."""
        self._first = 0.0
        difference, last = step.difference, self.history.past[0].velocity
        self.system.begin_step(step, self.history.rate(difference), self.history.missing(difference), last)

    def prescribe(self, t: float) -> None:
        """Set the velocities of the boundary to those at time t [s], until the next step begins."""
        self.prescribed_at = t
        self.flow[self.boundary.dofs] = self.boundary.velocity(t)

    def _present_pressure(self) -> Array:
        """Pressure [Pa] at local dofs, zero where it is no unknown."""
        return np.where(self.system.active_dofs & ~self.unknowns.velocity_mask, self.flow, 0.0)

    def predict(self, *, with_pressure: bool = False) -> None:
        """Predictor: extrapolate the velocity linearly from the last two steps, where both have one.

        with_pressure: the pressure, too, for first degree. With second degree, that of films follows their height.
        """
        self.before, self._share = self.flow[: self.unknowns.owned].copy(), 1.0
        if not self.steady:
            first_degree, fixed = self.settings.degree == 1, self.boundary.dofs
            self.history.extrapolate(self.flow, self.current.dt, fixed, with_pressure=with_pressure and first_degree)
        self.increment = self.flow[: self.unknowns.owned] - self.before

    def outside(self, surfaces: Mapping[str, Motion]) -> set[str]:
        """Names of the surfaces that lie outside of the box, which have nothing to do with the flow."""
        repeated = periodic_axes(self.patches)
        edges = [(axis, edge[0], edge[-1]) for axis, edge in enumerate(self.box.edges) if axis not in repeated]
        away = {name: [(m.x[:, i].max() < a, m.x[:, i].min() > b) for i, a, b in edges] for name, m in surfaces.items()}
        return {name for name, sides in away.items() if np.any(sides)}

    def has_films(self) -> bool:
        """Whether the present cut has films that are thinner than a cell (collective)."""
        return bool(self.comm.allreduce(self.cut.film is not None, op=MPI.LOR))

    def move(self, coupled: Mapping[str, Motion], *, with_solid: bool = False) -> None:
        """Cut the grid by the surfaces at their present positions (collective).

        coupled: motions of the bodies that another field moves, by name; the others move as prescribed.
        with_solid: a monolithic scheme solves the equations of these bodies too, which determine the pressure level of
        closed pockets.
        Raises StepFailed, see `follow_surfaces`.
        """
        self.motions = [coupled[b.surface.name] if b.motion is None else b.motion(self.current.t) for b in self.bodies]
        follow_surfaces(self, with_solid=with_solid)

    def solve(self) -> StepInfo:
        """Newton's method to the tolerance. Raises StepFailed."""
        self.steady_iteration.begin()
        self._first = 0.0
        info = converge(self, self.solver.newton)
        self.levels.keep(self.flow[: self.unknowns.owned])
        self.unknowns.share(self.system.flow)
        if not self._coupled:
            self._note_fast_bodies()
        numbers = {**info.numbers, "fluid.linear": float(self._iterations_of_step)}
        return replace(info, numbers=numbers, notes=tuple(self.notes))

    def _note_fast_bodies(self) -> None:
        if not self.settings.steady:
            self.notes += self._fast_bodies.notes({body.surface.name: m for body, m in self.moved()}, self.current.dt)

    def end_step(self) -> None:
        """Accept the step. Cells between surfaces in contact get the velocity zero."""
        if self._coupled:
            self._note_fast_bodies()
        self.system.end_step()
        found = self.system.active_dofs | self.system.dofs_of(self.cut.contact_cells)
        velocity = self.velocity()
        if self._behind is not None:
            velocity = self._behind.bounded(velocity, self.cut, self.surfaces.wet)
        self.history.end_step(self.current.dt, velocity, found, self._present_pressure())
        self.forget_step()
        self.started = True

    def forget_step(self) -> None:
        """Let the next step start from the present history."""
        self.began = None

    # ---------------------------------------------------------------------------- the system that Newton solves

    def residual(self) -> Array:
        """Norm [N] of the momentum rows and of the continuity rows times the impedance of a cell, shape (1,)."""
        with self.timer("assembly"):
            if self.settings.steady and self.steady_iteration.scales_follow:
                self.system.set_scales(self.velocity())
            self.residual_rows = self.system.residual()
        self.levels.spread_excess(self.residual_rows)
        self.residual_rows[self.held] = 0.0
        size = self._norm(self.residual_rows)
        self.steady_iteration.record(size)
        self._first = self._first or size
        return np.array([size])

    def forces(self) -> Array:
        """Norm [N] of the first residual of the solution, of those that are not zero: the change of forces, shape (1,).

        Those of later iterates, which may blow up, say nothing of the forces.
        """
        return np.array([self._first])

    def _norm(self, rows: Array) -> float:
        settings, h, alpha = self.settings, self.smallest_cell, self.current.difference.alpha
        impedance = settings.viscosity / h + settings.density * (self.system.fastest + h * alpha)
        scaled = np.where(self.unknowns.velocity_mask[: len(rows)], rows, impedance * rows)
        return math.sqrt(self.comm.allreduce(float(scaled @ scaled)))

    def advance(self, *, keep: bool = False, reduction: float = 0.0) -> Array:
        """One iteration of Newton's method; returns the increment relative to the solution. Raises StepFailed.

        keep: use the tangent of the last iterate if the same unknowns are held and the flow is unsteady.
        """
        matrix = self._tangent.of_increment(self.linearise, keep=keep and self.keeps_tangent())
        b, x = matrix.createVecs()
        b.array[:] = self.right_side()
        try:
            with self.timer("solve"):
                self.linear_iterations = self.linear_solver.solve(
                    matrix, b, x, self.held, self.system.dofs_near_surfaces
                )
            self._iterations_of_step += self.linear_iterations
        except linear.LinearSolveFailed as failure:
            raise StepFailed(self.name, str(failure), where=self.worst()) from failure
        return self.update(x.array)

    def suction(self) -> float:
        """Largest pressure below zero [Pa] around bodies whose closed contact is dry (collective)."""
        surfaces = [body.surface for body in self.bodies]
        dry = [s.zone == "dry" and s.in_contact is not None and bool(s.in_contact.any()) for s in surfaces]
        of_facets = np.repeat(dry, [len(s.facets) for s in surfaces])
        pieces = self.cut.pieces
        cells = self.cut.cut[pieces.cell[of_facets[pieces.facet]]]
        lowest = float(self.flow[self.unknowns.cell_pressure[cells]].mean(axis=1).min(initial=0.0))
        return float(self.comm.allreduce(-lowest, op=MPI.MAX))

    def keeps_tangent(self) -> bool:
        """Whether the last tangent has its rows of the identity where this iterate has them (collective)."""
        return self.comm.allreduce(self._tangent.holds(self.held), op=MPI.LAND) and not self.steady

    def linearise(self) -> PETSc.Mat:
        """The tangent at the present iterate; held rows are those of the identity. The next call overwrites it."""
        with self.timer("assembly"):
            picard = self.settings.steady and self.settings.convection and self.steady_iteration.far
            return self._tangent.linearise(self.held, self.rounded(), picard=picard)

    def right_side(self) -> Array:
        """Right-hand side for the increment of owned dofs: minus the residual."""
        return -self.residual_rows

    def rounded(self) -> Array:
        """The values whose rounding enters the residual: velocity [m/s] and pressure [Pa] at owned dofs."""
        return self.flow[: self.unknowns.owned]

    def update(self, increment: Array) -> Array:
        """Add an increment of the owned dofs; returns its norm relative to that of the flow, shape (1,)."""
        self.increment, self._improved = increment.copy(), True
        self.before, self._share = self.flow[: self.unknowns.owned].copy(), 1.0
        self._add_share()
        size = self._norm(self._tangent.diagonal * self.flow[: self.unknowns.owned])
        return np.array([self._norm(self._tangent.diagonal * self.increment) / size if size > 0.0 else 0.0])

    def multigrid(self, matrix: PETSc.Mat) -> PETSc.PC:
        """A multigrid cycle for the tangent; the next call overwrites it (collective)."""
        near, product = self.system.dofs_near_surfaces, self.product(matrix)
        return self.linear_solver.multigrid.preconditioner(matrix, self.held, near, product)

    def product(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """The tangent as it multiplies vectors in a Krylov method; the next call overwrites it (collective)."""
        return self.linear_solver.products.of(matrix)

    def _add_share(self) -> None:
        self.flow[: self.unknowns.owned] = self.before + self._share * self.increment
        self.unknowns.share(self.system.flow)

    def astray(self, rises: int) -> str:
        """Empty: a flow has no active set."""
        return ""

    def retreat(self, fraction: float) -> None:
        """Take back a fraction of the last increment.

        The state before is kept: a cut that covers nodes, or holds their pressure, overwrites their values.
        """
        self._share -= fraction
        self._add_share()

    def squeezed(self) -> Array:
        """Mean distance [m] by which elastic bodies squeeze each closed pocket in this step, after `solve`."""
        return self.current.dt * self.levels.squeezed()

    def add_levels(self, distance: Array) -> None:
        """Add the pressure that accelerates a cell of fluid by a distance [m] to the level of each such pocket."""
        self.levels.add(self.settings.density * self.smallest_cell / self.current.dt**2 * distance)

    def settled(self) -> bool:
        """True: a flow has no active set that an iterate could change."""
        return True

    def add_rounding(self, error: Array) -> None:
        """Add rounding errors at owned dofs that another field causes in these equations; call it after `linearise`."""
        self._tangent.add_rounding(error)

    def only_rounding(self) -> NDArray[np.bool_]:
        """Whether the norm of the residual is that of rounding errors, where this step linearised last, shape (1,).

        Not row by row: entries of the matrix near surfaces are sums whose terms cancel, and so are underestimated rows.
        A norm cannot hide anything, because rows of one fluid have errors of one size.
        """
        rounding = np.where(self.held, 0.0, self._tangent.rounding_error(self.linearise))
        return np.array([self._norm(self.residual_rows) <= self._norm(rounding)])

    def worst(self) -> tuple[float, ...] | None:
        """Position [m] of the node with the largest momentum residual (collective)."""
        nodes = self.unknowns.velocity
        size = np.abs(np.nan_to_num(self.residual_rows[nodes.dofs[: nodes.owned]], nan=np.inf)).max(axis=1)
        return position_of_largest(self.comm, size, nodes.points)

    # ---------------------------------------------------------------------------------------------- reactions

    def force(self) -> dict[str, Array]:
        """Force [N] (per depth in 2D) of the fluid on the vertices of each body, shape (n, dim) (collective)."""
        return self.surfaces.by_name(self.system.surface_force())

    def interface_entries(self, surfaces: Sequence[str]) -> InterfaceEntries:
        """Derivatives of rows and force by the motion of some bodies (collective)."""
        mark = np.pad(self.held.astype(float), (0, self.unknowns.local - self.unknowns.owned))
        held = fem.share_owned(self.unknowns.space, mark) > 0.5  # of ghosts too
        operator, vertices = self.system.interface, self.surfaces.vertices_of(surfaces)
        alpha, shape = self.current.difference.alpha, self.system.shape_derivatives(improved=self._improved)
        cut, difference = self.cut, self.current.difference
        swept = self.sweep.by_motion(cut.facets, cut.motion.x, cut.motion.v, difference)
        found = interface_entries(operator, self.unknowns, self.flow, alpha, held, vertices, shape, swept)
        zone = self.system.zone
        return found if zone is None else with_zone(found, zone, self.unknowns, self.flow, vertices)

    def balances(self) -> tuple[Array, float, float]:
        """(force [N] on all bodies by the balance of momentum, (dim,); power [W] lost by the method, power of patches).

        Collective.
        """
        self._balances = self._balances or Balances(self.system)
        return self._balances(self.held)

    def unsolved(self) -> tuple[float, float]:
        """Sums of |residual|: of the momentum [N] and of the continuity equations [m^3/s] (collective)."""
        size, in_momentum = np.abs(self.residual_rows), self.unknowns.velocity_mask[: self.size]
        force, rate = self.comm.allreduce(np.array([size[in_momentum].sum(), size[~in_momentum].sum()]))
        return float(force), float(rate)

    # ---------------------------------------------------------------------------------------- save and restore

    def save(self) -> State:
        """The state that the next step starts from; whole arrays where cells may change (collective)."""
        return saved_state(self)

    def restore(self, state: State) -> None:
        """Restore a saved state (collective)."""
        restore_state(self, state)

    def moved(self) -> Iterator[tuple[ImmersedBody, Motion]]:
        """Pairs of each body and its present motion."""
        return zip(self.bodies, self.motions, strict=True)
