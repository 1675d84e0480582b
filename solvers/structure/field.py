"""The field `Structure`: elastic bodies of finite deformation, static or dynamic, as one nonlinear system."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra import linear
from solvers.algebra.blocks import Layout
from solvers.algebra.largest import position_of_largest
from solvers.algebra.rounding import rounding_error
from solvers.algebra.rows import RowTransformation, TakenRows, gather, transform_rows
from solvers.api import Array, FailureKind, Indices, State, Step, StepFailed, StepInfo
from solvers.constraint import Constraint
from solvers.newton import converge
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Body
from solvers.structure.body_pieces import BodyPieces
from solvers.structure.constrained_dofs import ConstrainedDofs
from solvers.structure.deformation import LimitPoint, flown_off, inverted, largest_extent
from solvers.structure.energy import EnergyBalance, EnergySentinel
from solvers.structure.held import Held
from solvers.structure.inertia import ElasticInertia
from solvers.structure.instant import Instant
from solvers.structure.point_springs import PointSprings, SpringBetween
from solvers.structure.rigid_modes import attach_rigid_modes
from solvers.structure.saved import restore_state, saved_state
from solvers.structure.solid_solver import SolidSolver
from solvers.structure.supports import prescribe
from solvers.structure.tangent import Tangent
from solvers.structure.time_scheme import Statics, TimeScheme
from solvers.timing import Timer


class Structure:
    """All bodies. Newton's method solves f_int - f_ext = 0, with inertia and damping by the scheme `time`."""

    name = "structure"

    def __init__(
        self,
        bodies: Sequence[Body],
        time: TimeScheme = Statics(),
        settings: SolverSettings = SolverSettings(),
        *,
        contact: Constraint | None = None,
        exchanges_mass: bool = False,
        springs: Sequence[SpringBetween] = (),
        timer: Timer | None = None,
    ):
        """exchanges_mass: surfaces lose their mass only while their contact pairs are near, else for good."""
        self.exchanges_mass = exchanges_mass
        self.comm = comm = bodies[0].domain.comm
        self.bodies, self.time, self.settings = list(bodies), time, settings
        self.timer, self.constraint, self.dim = timer or Timer(), contact, bodies[0].dim
        self.layout = Layout(comm, [body.size for body in bodies])
        self.pieces = BodyPieces(comm, bodies)
        self.springs = PointSprings(springs, bodies, self.layout)
        self._constrained = None if contact is None else ConstrainedDofs(self.layout, contact, self.pieces)
        self.held = Held(self.layout, [prescribe(body) for body in bodies], self.dim)
        self.now, self.old = (Instant.zeros(self.layout.size) for _ in range(2))
        self.inertia = ElasticInertia(comm, bodies, self.pieces, lambda: self.time.massless(self))
        self.current = Step(0.0, 0.0)  #: the present step, or the last one
        self.last_length = 0.0  #: of the last accepted step [s], 0 at the start
        self.extrapolation = np.zeros(self.layout.size)  #: of the velocities of massless dofs in this step
        self.energy = EnergyBalance()
        self._limit_point = LimitPoint()
        loses = time.dissipates or contact is not None
        self.energy_sentinel = EnergySentinel(
            self.energy, self._limit_point, dissipates=loses, contact=contact is not None
        )
        self.residual_force = np.zeros(self.layout.size)  #: residual of the balance, at held dofs the reaction [N]
        self._unbalanced = self.residual_force  #: the residual at free dofs [N]
        self.target, self.increment = np.zeros(self.layout.size), np.zeros(self.layout.size)
        self.rounding: Array | None = None  #: rounding error of `residual_force` [N]; None before this step linearises
        self._stopping: Array | None = None  #: force that would stop the motion in this step [N]
        self._tangent: PETSc.Mat | None = None  #: at the present iterate, if it is assembled already
        self._imposed: PETSc.Mat | None = None  #: tangent of the last iterate with its supports; None in contact
        self._assembled_tangent = Tangent(bodies)
        self._b, self._x = self.layout.vector(), self.layout.vector()
        self._extent = largest_extent(comm, bodies)  #: [m]
        self._first = self.now.u, 0.0  #: displacement [m] and time [s] at the start of the run
        self._heights = np.concatenate([body.heights.repeat(self.dim) for body in bodies])  # of owned dofs [m]
        self.damping = time.create_damping(self)  #: of all bodies; None without damping
        self.solver = SolidSolver(self.comm, self.dim, self.dofs(), settings, contact=contact is not None)

    def has_symmetric_tangent(self) -> bool:
        """Whether tangents away from contact are symmetric (collective)."""
        # follower pressures have an unsymmetric boundary term, and the velocity of massless nodes has a rule of its own
        damped = self.damping is not None and (self.inertia.moves_mass() or not self.damping.symmetric)
        damped |= self.springs.turning_dampers
        return not (damped or any(len(body.pressures) > len(body.active) for body in self.bodies))

    def create_solver(self, *, contact: bool = False) -> PETSc.KSP:
        """The present linear solver, away from contact or in contact; created once (collective)."""
        return self.solver.current(symmetric=not contact and self.has_symmetric_tangent())

    def dofs(self) -> int:
        """Unknowns of all bodies on all processes, prescribed ones included."""
        return self.comm.allreduce(self.layout.size)

    def forget_mass(self) -> None:
        """Find the massless nodes anew, and all that follows from them."""
        self.inertia.forget()
        self._assembled_tangent.forget()

    def constrain(self, constraint: Constraint | None, *, exchanges_mass: bool) -> None:
        """Replace the constraint between steps; its state is the caller's (collective)."""
        self.constraint, self.exchanges_mass = constraint, exchanges_mass
        self._constrained = None if constraint is None else ConstrainedDofs(self.layout, constraint, self.pieces)
        self.forget_mass()
        if constraint is not None:
            self.energy_sentinel.allow_loss()

    def start_constraint(self) -> None:
        """Start the constraint from the first state of the run, whatever the present one is (collective)."""
        assert self.constraint is not None
        u, t = self._first
        self._place_bodies(u)
        stiffness = self.at_constraint(self._assembled_tangent.resistance(t))
        self._place_bodies(self.now.u)
        self.constraint.start(self.at_constraint(u), stiffness, t)

    def _place_bodies(self, displacement: Array) -> None:
        for body, u in zip(self.bodies, self.split(displacement), strict=True):
            body.set_displacement(u)

    def at_constraint(self, owned: Array) -> Array:
        """Values at the nodes of the constraint, shape (N, dim) (collective)."""
        assert self._constrained is not None
        return self._constrained.at_nodes(owned)

    # ------------------------------------------------------------------------------------------------- steps

    def initialise(self, t: float, dt: float) -> None:
        """Set initial displacement and velocity, and the acceleration by the loads at t [s]; dt [s]: the first step."""
        self.set_first_motion(t)
        self._first, self.current = (self.now.u.copy(), t), Step(t, dt)
        if self.constraint is not None and self.exchanges_mass:
            self.constraint.present[:] = False
            u, v = self.at_constraint(self.now.u), self.at_constraint(self.now.v)
            self.constraint.present = self.constraint.find_present(u, v, t, dt)
            self.forget_mass()
        self._assemble_bodies()
        if self.constraint is not None:
            self.start_constraint()
        self.time.start(self, t, dt)
        self.energy.start(*self._energies())

    def set_first_motion(self, t: float) -> None:
        """Set initial displacement [m] and velocity [m/s] at the first time t [s]."""
        for body, u, v in zip(self.bodies, self.split(self.now.u), self.split(self.now.v), strict=True):
            for target, value in ((u, body.initial_displacement), (v, body.initial_velocity)):
                if value is not None:
                    target[:] = body.nodal(value, t)[: body.owned].ravel()

    def _energies(self) -> tuple[float, float, float]:
        """Kinetic energy, internal energy, and energy that friction has dissipated [J]."""
        internal = sum(body.internal_energy() for body in self.bodies)
        friction = 0.0 if self.constraint is None else self.constraint.friction_work
        return self.time.kinetic_energy(self), internal, friction

    def take_materials(self) -> None:
        """Go on from the restored state with other materials and springs: present forces and energies are theirs."""
        for body, internal in zip(self.bodies, self.split(self.now.internal), strict=True):
            internal[:] = body.internal_force()
        kinetic, stored, _ = self._energies()
        self.energy.revalue(kinetic, stored)

    @contextmanager
    def by(self, time: TimeScheme, held: Held, t: float, dt: float) -> Iterator[None]:
        """A step to the same time t by another scheme and other supports, for the start; the caller solves it."""
        own = self.time, self.held
        self.time, self.held = time, held
        try:
            self.begin_step(t - dt, dt)
            yield
        finally:
            self.time, self.held = own
        if self.constraint is not None:
            self.constraint.end_step(time.force_weight)

    def take_start(self, u: Array) -> None:
        """Set the displacements [m] at owned dofs for the start; velocity, acceleration and load are kept."""
        self.now.u = self.held.free_part(u) + self.held.displacement(self.current.t)
        self.assemble()
        self.energy.start(*self._energies())

    def step(self, t: float, dt: float) -> StepInfo:
        """One step from t to t + dt. Raises StepFailed."""
        self.begin_step(t, dt)
        info = self.solve()
        self.end_step()
        return info

    def begin_step(self, t: float, dt: float) -> None:
        """Store the state at t [s] and predict that at t + dt."""
        self.time.prepare(self, t, dt)
        self.old = self.now.copy()
        self.extrapolation = self.time.extrapolation(self, t, dt)
        for body in self.bodies:
            body.element.begin_step(dt)
        self.current = Step(t + dt, dt)
        self.inertia.begin_step(self.old.v, self.old.a, self.old.rigid)
        # not part of the saved state: a resumed run must start alike
        self.rounding = self._tangent = self._imposed = self._stopping = None
        self.solver.begin_step()
        if self.constraint is not None:
            self.constraint.begin_step()
        self.target = self.held.displacement(t + dt)
        self.now.u += self.time.guess(self, dt)

    def load(self, force: Array) -> None:
        """Set the forces [N] of another field at the end of the step, at owned dofs."""
        self.now.surface[:] = force

    def solve(self) -> StepInfo:
        """Newton's method to the tolerance. Raises StepFailed."""
        if self.constraint is not None:
            # other loads may have chosen the earlier sets
            self.constraint.begin_solve()
        try:
            info = converge(self, self.settings.newton)
        except StepFailed as failure:
            self.check_deformation(failure.iteration, failure.history)
            if not (beyond := self._limit_point.explain()):
                raise
            kind = None if failure.kind is FailureKind.NOT_FINITE else FailureKind.LIMIT_POINT
            raise failure.with_reason(failure.reason + beyond, kind) from None
        self.check_deformation(info.iterations, info.residuals)
        return info if self.constraint is None else replace(info, numbers=self.constraint.numbers())

    def check_deformation(self, iteration: int, history: tuple[float, ...]) -> None:
        """Raise StepFailed if displacements are unbounded, as of bodies without supports, or an element is inverted."""
        kind, where = FailureKind.UNSUPPORTED, None
        reason = flown_off(self.comm, self.now.u, self._extent)
        if reason is not None:
            where = self.worst()
        elif found := inverted(self.bodies):
            kind, (reason, where) = FailureKind.INVERTED, found
            reason += self._limit_point.explain()
        if reason is not None:
            raise StepFailed(self.name, kind, reason, iteration=iteration, where=where, history=history)

    def end_step(self) -> None:
        """Accept the step."""
        pushed = np.zeros(2)
        if self.constraint is not None:
            pushed -= self.constraint.obstacle_work
            self.constraint.end_step(self.time.force_weight)
            pushed += self.constraint.obstacle_work
        du, now, old, averaged = self.now.u - self.old.u, self.now, self.old, self.time.averaged
        now.mean, self.last_length = du / self.current.dt, self.current.dt
        at_supports, (before, after) = self.held.part(du), self.time.support_forces(self)
        parts = [
            averaged(old.loads, now.loads) @ du,
            averaged(old.surface, now.surface) @ du,
            0.5 * (before + after) @ at_supports,
            self.time.damping_force(self) @ du,
            0.5 * (now.loads - old.loads) @ du,
            0.5 * (now.surface - old.surface) @ du,
            0.5 * (after - before) @ at_supports,
            self.held.free_part(self.residual_force) @ du,
            0.0 if self.rounding is None else self.rounding @ self.rounded(),  # of the internal energy
        ]
        if isinstance(self.time, Statics) and self.current.dt > 0.0:
            self._limit_point.accept(self.current.t, self.norm(du) / self.current.dt)
        sums = self.comm.allreduce(np.array(parts)).tolist()
        works, damping = [*sums[:3], float(pushed[0])], sums[3] + sum(body.element.end_step() for body in self.bodies)
        doubt = sum(map(abs, (*sums[4:], float(pushed[1]))))
        self.energy.add_step(works, damping, *self._energies(), doubt)

    def split(self, array: Array) -> list[Array]:
        """Views of the parts of an array of owned dofs, by body."""
        return self.layout.split(array)

    # ---------------------------------------------------------------------------- the system that Newton solves

    def assemble(self) -> None:
        """Compute forces at the present displacement."""
        self._assemble_bodies()
        self._assemble_constraint()

    def _assemble_bodies(self) -> None:
        now = self.now
        parts = zip(self.bodies, *(self.split(a) for a in (now.u, now.internal, now.loads)), strict=True)
        for body, u, internal, loads in parts:
            body.set_displacement(u)
            internal[:] = body.internal_force()
            loads[:] = body.external_force(self.current.t)
        now.loads += self.springs.force(self)
        self.inertia.find_frame(now.u)

    def _assemble_constraint(self) -> None:
        if self.constraint is not None and self._constrained is not None:
            self.constraint.evaluate(self._constrained.at_nodes(self.now.u), self.current.t)
            self.now.constraint[:] = self._constrained.force()

    def follow(self) -> None:
        """Nothing depends on the iterate before its residual."""

    def residual(self) -> Array:
        """Norm [N] of the balance at the free dofs and of the residual of the constraint, by piece."""
        self.now.v, self.now.a = self.time.motion(self, self.current.dt)
        with self.timer("assembly"):
            self._assemble_bodies()
        with self.timer("contact"):
            self._assemble_constraint()
        self.now.rigid = self.time.rigid_force(self, self.current.dt)
        if self.damping is not None:
            self.now.damping = self.damping.force(self.now.v)
        self.residual_force = self.time.balance(self)
        self._unbalanced = self.held.free_part(self.residual_force)
        missed = None if self._constrained is None else self._constrained.missed(self.time.force_weight)
        return self.pieces.norms([self._unbalanced], missed)[0]

    def forces(self) -> Array:
        """Norm [N] of the largest force on each piece: internal, external, of the constraint.

        They are those of the present iterate. A residual would not do: that of an iterate that has blown up says
        nothing of the forces, and that of a support that moves none. What would stop the motion in one step counts too,
        because in free flight there are no other forces.
        """
        now = self.now
        if self._stopping is None:
            self._stopping = self.time.stopping_force(self)
        return self.pieces.norms([now.internal, now.external, now.constraint, self._stopping]).max(axis=0)

    def tangent(self) -> PETSc.Mat:
        """d(balance)/du without supports; the next call overwrites the matrix."""
        return self._assembled_tangent.assemble(self, self.time)

    def advance(self, *, keep: bool = False, reduction: float = 0.0) -> Array:
        """One iteration of Newton's method; returns |du| / |u| by piece. Raises StepFailed.

        keep: use the matrix and the factors of the last iterate, away from contact. reduction: of the residual of the
        linear system that is good enough. It applies in contact, where the first iterates only find the active set;
        elsewhere one exact solution may be all that is needed.
        """
        change = self.row_transformation() if self._touching else None
        taken, imposed = None, self._imposed
        added, free = self.added_product(), None
        self._x.array[:] = self.missing_displacement()
        self._b.array[:] = self.right_side()
        if added is not None:
            self._b.array[:] -= added(self._x.array)
            free = partial(lambda product, du: product(self.held.free_part(du)), added)
        if keep and change is None and imposed is not None and not self.norm(self._x.array):
            matrix = imposed
            self._b.array[:] = self.held.free_part(self._b.array)
        else:
            matrix, self._tangent = self._tangent or self.linearise(), None
            if change is not None:
                with self.timer("contact"):
                    matrix, taken = transform_rows(matrix, self._b, change)
            matrix = self.held.impose(matrix, self._x, self._b)
        self._imposed = matrix if change is None else None
        symmetric, enough = (self.has_symmetric_tangent(), 0.0) if change is None else (False, reduction)
        try:
            with self.timer("solve"):
                self.solver.solve(
                    matrix, self._b, self._x, self._attach_modes, symmetric=symmetric, reduction=enough, added=free
                )
        except linear.LinearSolveFailed as failure:
            raise StepFailed(self.name, failure.kind, str(failure), where=self.worst()) from failure
        if taken is not None:
            self.recover(taken, gather(self.comm, self._x.array))
        return self.update(self._x.array)

    def added_product(self) -> Callable[[Array], Array] | None:
        """The part of the tangent that `linearise` lacks, as a product with owned dofs: of the inertia `rigid`."""
        rigid, frame, factor = self.inertia.find_rigid(), self.inertia.frame, self.time.rigid_factor(self.current.dt)
        if rigid is None or frame is None or not factor:
            return None
        product = rigid.product(frame)
        return lambda du: self.held.free_part(factor * product(du))

    @property
    def _touching(self) -> bool:
        """Whether multipliers act at the present iterate."""
        return self.constraint is not None and self.constraint.acts

    def _attach_modes(self, matrix: PETSc.Mat) -> None:
        attach_rigid_modes(matrix, self.bodies, self.now.u)

    def linearise(self) -> PETSc.Mat:
        """The tangent at the present iterate without supports, and the rounding error; the next call overwrites it."""
        with self.timer("assembly"):
            matrix = self.springs.added_to(self, self.tangent())
        # an entry is a sum over the 2^dim cells at a node, whose terms may cancel
        self.rounding = 2.0**self.dim * rounding_error(matrix, self.rounded())
        return matrix

    def rounded(self) -> Array:
        """Magnitudes whose rounding enters the balance, at owned dofs [m]: |u|, and h for that of I + grad u."""
        return np.abs(self.now.u) + self._heights

    def missing_displacement(self) -> Array:
        """Prescribed minus present displacements at owned dofs [m], zero at free ones."""
        return self.target - self.held.part(self.now.u)

    def right_side(self) -> Array:
        """Right-hand side for the increment [N]; near contact without the contact force at the end of the step."""
        if self.constraint is None or not self.constraint.near:
            return -self.residual_force
        return -(self.residual_force + self.time.force_weight * self.now.constraint)

    def row_transformation(self) -> RowTransformation | None:
        """Transformation that eliminates contact multipliers from tangent and `right_side`; None if none are near."""
        if self.constraint is None or not self.constraint.near:
            return None
        with self.timer("contact"):
            return self.constraint.condense(self.time.force_weight)

    def recover(self, taken: TakenRows, du: Array) -> None:
        """Compute the multipliers from the rows before the transformation and the increment of all unknowns."""
        assert self._constrained is not None
        with self.timer("contact"):
            self._constrained.recover(taken, du)

    def update(self, increment: Array) -> Array:
        """Add an increment of the owned dofs; returns |du| / |u| by piece."""
        self.increment = increment.copy()
        self.now.u += self.increment
        self.now.u = self.held.free_part(self.now.u) + self.target
        change, size = self.pieces.norms([self.increment, self.now.u])
        return np.divide(change, size, out=np.zeros_like(size), where=size > 0.0)

    def retreat(self, fraction: Array) -> None:
        """Take back fractions of the last increment, by piece."""
        self.now.u -= fraction[self.pieces.of_dofs] * self.increment
        if self._constrained is not None:
            self._constrained.retreat(fraction)

    def linked(self) -> Indices:
        """Numbers of pieces: the smallest of those that touch, are tied or joined by springs (collective)."""
        touching = [] if self._constrained is None else [self._constrained.linked()]
        return self.pieces.linked([*self.springs.linked(self, self.pieces.of_dofs), *touching])

    def cycle(self) -> str:
        """What cycles in contact."""
        return "" if self._constrained is None else self._constrained.cycle()

    def astray(self, risen: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
        """The pieces of an active set that cycles, and those in contact whose residual rose twice."""
        none = np.zeros(self.pieces.count, dtype=bool)
        return none if self._constrained is None else self._constrained.astray(risen)

    def settled(self) -> bool:
        """Whether the prescribed displacements are reached and the active set has not changed (collective)."""
        reached = self.held.reached(self.now.u, self.target, self._extent)
        reached = reached and (self.constraint is None or self.constraint.settled)
        return self.comm.allreduce(reached, op=MPI.LAND)

    def add_rounding(self, error: Array) -> None:
        """Add rounding errors at owned dofs that another field causes in the balance; call it after `linearise`."""
        assert self.rounding is not None
        self.rounding = self.rounding + error

    def only_rounding(self) -> NDArray[np.bool_]:
        """Whether the residual is rounding errors in all rows of a piece, where this step linearised last."""
        if first := self.rounding is None:
            self._tangent = self.linearise()
        assert self.rounding is not None
        found = self.pieces.below(self._unbalanced, self.rounding)
        if self._constrained is None or not self._constrained.near:
            return found
        if first and not found.any():  # the errors of contact would take as long as another iterate
            return found
        of_force, fulfilled = self._constrained.rounding(self.time.force_weight, times=2.0**self.dim)
        return fulfilled & self.pieces.below(self._unbalanced, self.rounding + of_force)

    def worst(self) -> tuple[float, ...] | None:
        """Reference position [m] of the largest residual relative to the forces on its piece (collective)."""
        size = np.abs(self.held.free_part(np.nan_to_num(self.residual_force, nan=np.inf)))
        forces = np.nan_to_num(self.forces(), nan=np.inf)[self.pieces.of_dofs]
        size = np.divide(size, forces, out=size, where=(forces > 0.0) & np.isfinite(forces))
        points = [body.points[: self.dim, : body.owned].T for body in self.bodies]
        return position_of_largest(self.comm, size, np.repeat(np.concatenate(points), self.dim, axis=0))

    def norm(self, array: Array) -> float:
        """Euclidean norm of owned dofs over all processes."""
        return float(np.sqrt(self.comm.allreduce(float(array @ array))))

    # ---------------------------------------------------------------------------------------- save and restore

    def save(self) -> State:
        """The state that the next step starts from, by body."""
        return saved_state(self)

    def restore(self, state: State) -> None:
        """Restore a saved state."""
        restore_state(self, state)
