"""The field `RigidBodies`: six unknowns for each body, three in 2D, and their balance of forces and moments."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.connected import connected_parts
from solvers.algebra.rounding import rounding_error
from solvers.algebra.rows import RowTransformation, TakenRows
from solvers.algebra.sparse import Sparse, block_diagonal
from solvers.algebra.vertices import VertexJacobian
from solvers.api import Array, Indices, State, Step, StepInfo
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Smooth, Tolerance, converge
from solvers.rigid import line_springs, motion, surface
from solvers.rigid.body import RigidBody, in_space
from solvers.rigid.contact import RigidContact
from solvers.rigid.coulomb import solver
from solvers.rigid.line_springs import LineSpring
from solvers.rigid.motion import RigidInstant
from solvers.rigid.near import Moment
from solvers.rigid.predicted import leave_others
from solvers.rigid.rotation import vector_rate
from solvers.rigid.supported import supported
from solvers.timing import Timer

#: Unknowns of a body among `COMPONENTS`, by dimension of space.
UNKNOWNS = {2: np.array([0, 1, 5]), 3: np.arange(6)}


class RigidBodies(Smooth):
    """Implements `Solid`. Every process has all bodies; one owns the unknowns, the first unless they are `behind`.

    The unknowns of a body are its increments in a step: displacement of the centre [m] and rotation vector in space
    [rad]. `held` components are prescribed, the others follow from the balance of forces and moments.
    """

    name = "rigid bodies"

    def __init__(
        self,
        bodies: Sequence[RigidBody],
        scheme: GeneralisedAlpha = GeneralisedAlpha.from_rho_inf(1.0),
        tolerance: Tolerance = Tolerance(),
        *,
        springs: Sequence[LineSpring] = (),
        contact: RigidContact | None = None,
        timer: Timer | None = None,
        comm: MPI.Comm = MPI.COMM_WORLD,
    ):
        self.bodies, self.scheme, self.tolerance, self.springs = list(bodies), scheme, tolerance, springs
        self.comm, self.timer, self.contact = comm, timer or Timer(), contact
        self.static = not any(body.inertia.mass for body in bodies)
        self.dim, self.extents = bodies[0].dim, np.array([body.extent for body in bodies])
        self.components = UNKNOWNS[self.dim]
        self.unknowns = len(bodies) * len(self.components)  #: count on all processes
        self._owner = 0  #: process that owns the unknowns
        self.size = self.unknowns if comm.rank == 0 else 0
        self.first = 0  #: number of the first unknown in the system of the solid
        self.surfaces = {body.name: body.points for body in bodies}
        self.now = [RigidInstant.at_rest() for _ in bodies]
        self.old = list(self.now)
        self.on_surface = self.on_surface_old = np.zeros((len(bodies), 6))  #: force and moment by the flow [N, N m]
        self._forces = [np.zeros((len(body.points), self.dim)) for body in bodies]  #: on the vertices [N]
        self._pressing: list[tuple[int, Array, Array]] = []  #: see `press`
        self._pressed_weight = 1.0
        self.pressed = self.pressed_old = np.zeros(self.unknowns)  #: by contact with others, at present [N, N m]
        self._u, self._last, self._held_u = np.zeros((3, len(bodies), 6))  #: increments: whole, last one, of held ones
        self.current = Step(0.0, 0.0)  #: the present step, or the last one
        free = np.ones((len(bodies), 6), dtype=bool)
        for index, body in enumerate(bodies):
            free[index, body.held_components] = False
        self._free = free[:, self.components].ravel()
        self.balance, self._exchanged = np.zeros(self.unknowns), 0.0  # [J]
        self._noise: Array | None = None  #: rounding errors of the balance; None before this step linearises

    def behind(self, others: int) -> None:
        """Let other unknowns, `others` on all processes, come first; the last process owns those of this field."""
        self._owner, self.first = self.comm.size - 1, others
        self.size = self.unknowns if self.comm.rank == self._owner else 0

    # ------------------------------------------------------------------------------------------------- steps

    @property
    def force_weight(self) -> float:
        return 1.0 - self.scheme.alpha_f

    def mean_load(self, before: Array, after: Array) -> Array:
        return self.force_weight * after + (1.0 - self.force_weight) * before

    def weighted(self, rows: Sparse) -> Sparse:
        return self.force_weight * rows

    def initialise(self, t: float, dt: float) -> None:
        """Set initial velocities, and accelerations by the loads at the time t [s]; dt [s]: the first step."""
        self.current = Step(t, 0.0)
        begun = [motion.at_start(body, t, dt) for body in self.bodies]
        begun = line_springs.with_springs(self.springs, self.bodies, begun)
        self.now = [motion.with_rates(body, now, t, dt) for body, now in zip(self.bodies, begun, strict=True)]
        self.old = list(self.now)

    def step(self, t: float, dt: float) -> StepInfo:
        """One step from t to t + dt without a flow. Raises StepFailed."""
        self.begin_step(t, dt)
        self.extrapolate()
        info = self.solve()
        self.end_step()
        return info

    def begin_step(self, t: float, dt: float, held: Array | None = None) -> None:
        """Store the state at t; held: increments of held components, shape (bodies, 6), None: by their functions."""
        self.old, self.on_surface_old, self.pressed_old = list(self.now), self.on_surface.copy(), self.pressed.copy()
        self.current, self._noise = Step(t + dt, dt), None
        if self.contact is not None:
            self.contact.begin_step()
        self._u[:] = self._held_u[:] = 0.0
        for index, (u, body) in enumerate(zip(self._held_u, self.bodies, strict=True)):
            prescribed = body.held_at(t + dt) - body.held_at(t) if held is None else held[index, body.held_components]
            u[body.held_components] = prescribed
        self.set_increments(self._held_u)

    def extrapolate(self) -> None:
        """Predictor: free components keep their velocity; in statics they stay, as those of elastic bodies do."""
        u, path = self._held_u.copy(), self.current.dt * self._velocity(self.old)
        u[:, self.components] += np.where(self._free & (not self.static), path, 0.0).reshape(len(u), -1)
        self._last = u - self._u
        self.set_increments(u)

    def predict(self, t: float) -> None:
        """The same beside a flow: bodies do not enter others. Alone, Newton's method is as quick to find this."""
        self.extrapolate()
        if self.contact is not None:
            with self.timer("contact"):
                leave_others(self.contact, self._by_component(self._u), self._measure, self._upright(), self._add)
            self._last = self._u - self._held_u

    def increments(self) -> Array:
        """Increments in the present step: displacement [m] and rotation vector in space [rad], shape (bodies, 6)."""
        return self._u.copy()

    def set_increments(self, u: Array) -> None:
        """Set the increments u since the start of the step, shape (bodies, 6)."""
        self._u = u
        now = [
            motion.moved(body, self.scheme, old, part, self.current.t, self.current.dt)
            for body, old, part in zip(self.bodies, self.old, u, strict=True)
        ]
        self.now = line_springs.with_springs(self.springs, self.bodies, now)

    def solve(self) -> StepInfo:
        """Newton's method to the tolerance, under the present load. Raises StepFailed."""
        info = converge(self, self.tolerance)
        self.check(info)
        return replace(info, numbers=self.numbers())

    def check(self, info: StepInfo) -> None:
        """Raise StepFailed for a body that rotates by half a turn or more in a step."""
        motion.require_short_turns(self.name, self.bodies, self._u, info)

    def end_step(self) -> None:
        """Accept the step; with contact, velocities and rates of momentum are those after the impact."""
        with self.timer("contact"):
            self._end_contact()
        for body, now, old in zip(self.bodies, self.now, self.old, strict=True):
            self._exchanged += abs(motion.kinetic_energy(body, now) - motion.kinetic_energy(body, old))

    def exchanged(self) -> float:
        """Sum of all changes of kinetic energy [J]: what others have given and taken."""
        return self._exchanged

    def _end_contact(self) -> None:
        self.balance = self._own_balance()
        if self.contact is None or self.static or not self.contact.active.any():
            return
        inertia = np.array([motion.mass(body, now.R) for body, now in zip(self.bodies, self.now, strict=True)])
        mass = block_diagonal(motion.without_held(inertia[:, self.components][:, :, self.components], self._free))
        before, weight, w = self._velocity(self.old), self.force_weight, self._pressed_weight
        force, force_before = (
            self._by_component(np.array([one.load for one in some]) + by_flow)
            for some, by_flow in ((self.now, self.on_surface), (self.old, self.on_surface_old))
        )
        mean = weight * force + (1.0 - weight) * force_before
        gyroscopic = self._by_component(np.array(list(map(motion.gyroscopic, self.bodies, self.now))))
        turned = self._by_component(np.array(list(map(motion.turned_on, self.bodies, self.old, self.now))))
        pushed = self.current.dt * (mean + w * self.pressed + (1.0 - w) * self.pressed_old)
        force = force + self.pressed
        without = np.where(self._free, before + solver(mass)(turned + pushed), self._velocity(self.now))
        closed = self.contact.closed(mass, without, np.where(self._free, force, 0.0), gyroscopic)
        velocity, rate = closed.after(before, without, self.contact.restitution)
        rate = np.where(self._free, rate, self._by_component(np.array([now.p for now in self.now])))
        ends = zip(self.now, *(np.split(part, len(self.bodies)) for part in (velocity, rate)), strict=True)
        self.now = [motion.with_motion(now, self.components, v, p) for now, v, p in ends]

    def _velocity(self, instants: Sequence[RigidInstant]) -> Array:
        """Velocities of the centres [m/s] and angular velocities in space [rad/s], by unknown."""
        return self._by_component(np.array([np.concatenate([now.v[:3], motion.spin(now)]) for now in instants]))

    # ---------------------------------------------------------------------------------------------- the surface

    def displacement(self) -> Array:
        """Displacements [m] of all vertices, shape (n, dim)."""
        return surface.displacements(self.bodies, self.now)

    def jacobian(self) -> VertexJacobian:
        found = surface.jacobian(self.bodies, self.now, self.components)
        return VertexJacobian(self.first + found.columns, found.values) if self.first else found

    def _by_body(self, force: Array) -> list[Array]:
        return np.split(force, np.cumsum([len(body.points) for body in self.bodies])[:-1])

    def load(self, force: Array) -> None:
        """Set the force [N] of the flow on all vertices, shape (n, dim)."""
        self._forces = self._by_body(force)
        self.on_surface = surface.resultants(self.bodies, self.now, self._forces)

    def press(self, forces: Sequence[tuple[int, Array, Array]], weight: float) -> None:
        """Set the forces of contact with bodies of another field.

        forces: (body, points at the start [m], force on them [N], both of shape (n, dim)); weight: of those at the end
        of the step in the balance, the same as in that of the others, so that momentum is kept.
        """
        self._pressing, self._pressed_weight = list(forces), weight
        total = np.zeros((len(self.bodies), 6))
        for index, points, given in forces:
            f, arms = in_space(given), self.bodies[index].arms(self.now[index].R, points)
            total[index] += np.concatenate([f.sum(axis=0), np.cross(arms, f).sum(axis=0)])
        self.pressed = self._by_component(total)

    def points_of(self, index: int, points: Array, t: float) -> Array:
        """Positions [m] of points of a body, given at the start, (n, dim); at other times than now by its velocity."""
        body, now = self.bodies[index], self.now[index]
        arms = body.arms(now.R, points)
        found = body.inertia.centre + (now.shift + arms)[:, : self.dim]
        if t != self.current.t:
            found = found + (t - self.current.t) * (now.v[:3] + np.cross(motion.spin(now), arms))[:, : self.dim]
        return found

    def reduced(self, force: Array) -> Array:
        """Forces [N] and moments [N m], by unknown, of forces on the vertices, (n, dim)."""
        return self._by_component(surface.resultants(self.bodies, self.now, self._by_body(force)))

    def taken(self) -> Array:
        """Load [N, N m] by the balance of momentum, own loads and contact; of held components that of the flow."""
        weight = self.force_weight
        handed_over = self._by_component(weight * self.on_surface + (1.0 - weight) * self.on_surface_old)
        return np.where(self._free, self.balance, handed_over)

    def taken_at_start(self) -> Array:
        return np.zeros(self.unknowns)

    def moved(self) -> Array:
        """Increments of the last step [m, rad]."""
        return self._by_component(self._u)

    def _by_component(self, values: Array) -> Array:
        return values[:, self.components].ravel()

    # ---------------------------------------------------------------------------- the system that Newton solves

    def _own_balance(self) -> Array:
        """(1 - alpha_m) p + alpha_m p_n, minus the averaged own loads and the contact force, by unknown."""
        m, f = self.scheme.alpha_m, self.scheme.alpha_f
        parts = zip(self.now, self.old, strict=True)
        rows = [(1 - m) * now.p + m * old.p - (1 - f) * now.load - f * old.load for now, old in parts]
        balance = self._by_component(np.array(rows))
        if self.pressed.any() or self.pressed_old.any():
            w = self._pressed_weight
            balance = balance - (w * self.pressed + (1.0 - w) * self.pressed_old)
        return balance if self.contact is None else balance - self.contact.force

    def follow(self) -> None:
        """Nothing depends on the iterate before its residual."""

    def residual(self) -> Array:
        """Norm [N] of the balance of each body; moments are divided by its size."""
        self.on_surface = surface.resultants(self.bodies, self.now, self._forces)  # whose moments turn with the bodies
        mean = self._by_component(self.mean_load(self.on_surface_old, self.on_surface))
        if self.contact is not None:
            self.contact.forget()
        self.balance = np.where(self._free, self._own_balance() - mean, 0.0)
        if self.contact is None:
            return self._norms(self.balance)
        with self.timer("contact"), supported():
            self._measure()
            self.contact.press(self._system(), self._upright, -self.balance)
        return self._norms(self.balance - self.contact.force)

    def _measure(self) -> None:
        """Set the gaps of the iterate."""
        assert self.contact is not None
        moment = Moment(self.bodies, self.now, self.old, self.current.t, self.current.dt)
        self.contact.measure(moment, self.components, self._free)

    def _norms(self, rows: Array) -> Array:
        """Norm [N] of forces and moments of each body, shape (bodies,)."""
        arms = np.where(self.components < 3, 1.0, self.extents[:, None])
        return np.linalg.norm(rows.reshape(arms.shape) / arms, axis=1)

    def forces(self) -> Array:
        """Norm [N] of the largest force on each body: rate of momentum, own loads, those of the flow and of contact.

        The momentum over the length of the step counts too, because in free flight there are no others.
        """
        rates, loads = np.array([now.p for now in self.now]), np.array([now.load for now in self.now])
        before = [motion.momentum(body, old.R, old.v) for body, old in zip(self.bodies, self.old, strict=True)]
        momentum = np.array(before) / self.current.dt
        all_forces = [self.pressed, *(self._by_component(some) for some in (rates, loads, momentum, self.on_surface))]
        if self.contact is not None:
            all_forces.append(self.contact.force)
        return np.max([self._norms(rows) for rows in all_forces], axis=0)

    def tangent(self) -> Sparse:
        """d(balance)/d(unknowns); forces on the vertices turn with them, and contact forces as at the last residual."""
        return self._turning(self._blocks(), np.ones(self.unknowns, dtype=bool))

    def _turning(self, blocks: Array, free: NDArray[np.bool_]) -> Sparse:
        """The tangent of all bodies, where contact forces turn; free: mask of the unknowns."""
        own = self._with_springs(blocks, free)
        return own if self.contact is None else own + self.contact.stiffness

    def _with_springs(self, blocks: Array, free: NDArray[np.bool_]) -> Sparse:
        """The same without contact."""
        if not self.springs:
            return block_diagonal(blocks)
        rates = motion.velocity_rates(self.scheme, self.old, self.now, self._u[:, 3:], self.current.dt)
        loads = line_springs.tangent(self.springs, self.bodies, self.now, rates, self.components, free)
        return block_diagonal(blocks) + -self.force_weight * loads

    def _blocks(self) -> Array:
        """The tangent of each body alone, shape (bodies, unknowns of a body, unknowns of a body)."""
        turned = surface.turned_blocks(self.bodies, self.now, self._forces, self.components)
        return self._upright_blocks() - self.force_weight * turned

    def _upright_blocks(self) -> Array:
        """The same where forces of the flow do not turn."""
        found = motion.own_tangents(self.bodies, self.scheme, self.old, self.now, self._u[:, 3:], self.current)
        for index, points, force in self._pressing:
            body, now = self.bodies[index], self.now[index]
            found[index, 3:, 3:] -= self._pressed_weight * surface.turned(body, now, points, force)
        return found[:, self.components[:, None], self.components]

    def linearise(self) -> PETSc.Mat:
        """The tangent as a distributed matrix."""
        own, tangent = (self.size, None), self.tangent().ordered()[np.arange(self.size)]
        entries = tangent.indptr.astype(PETSc.IntType), tangent.indices.astype(PETSc.IntType), tangent.data
        matrix = PETSc.Mat().createAIJ((own, own), csr=entries, comm=self.comm)
        self._noise = rounding_error(matrix, self.rounded())
        return matrix

    def advance(self, *, keep: bool = False, reduction: float = 0.0) -> Array:
        """One Newton iteration; returns increments relative to those of the step, by body. It keeps no tangent."""
        right = -self.balance if self.contact is None else self.contact.force - self.balance
        with supported():
            if self.contact is None and not self.springs:
                blocks = motion.without_held(self._blocks(), self._free)
                return self._add(np.linalg.solve(blocks, right.reshape(*blocks.shape[:2], 1)).ravel())
            return self._add(solver(self._system() if self.contact is None else self.contact.tangent)(right))

    def _system(self) -> Sparse:
        """The tangent with rows and columns of the identity for held components."""
        return self._turning(motion.without_held(self._blocks(), self._free), self._free)

    def _upright(self) -> Sparse:
        """The same where forces of the flow and of contact do not turn."""
        return self._with_springs(motion.without_held(self._upright_blocks(), self._free), self._free)

    def right_side(self) -> Array:
        """Minus the balance, without the contact forces at the end of the step."""
        right = -self.balance
        if self._pressing:
            right = right - np.where(self._free, self._pressed_weight * self.pressed, 0.0)
        return right[: self.size]

    def update(self, increment: Array) -> Array:
        """Add increments of the owned unknowns; returns their norm relative to that of the step, by body."""
        return self._add(self._from_owner(increment.copy()))

    def _from_owner(self, owned: Array) -> Array:
        """Values of all unknowns from those of the process that owns them (collective)."""
        return self.comm.bcast(owned if self.comm.rank == self._owner else None, root=self._owner)

    def _add(self, increment: Array) -> Array:
        added = np.zeros_like(self._u)
        added[:, self.components] = np.where(self._free, increment, 0.0).reshape(len(added), -1)
        for part, u in zip(added, self._u, strict=True):
            part[3:] = vector_rate(u[3:]) @ part[3:]
        self._last = added
        self.set_increments(self._u + added)
        scale = np.where(np.arange(6) < 3, 1.0, self.extents[:, None])  # of rotations the size of the body [m]
        change, size = (np.linalg.norm(scale * u, axis=1) for u in (added, self._u))
        return np.divide(change, size, out=np.zeros_like(size), where=size > 0.0)

    def parts_of(self, names: Collection[str]) -> NDArray[np.bool_]:
        return np.array([body.name in names for body in self.bodies])

    def retreat(self, fraction: Array) -> None:
        """Take back fractions of the last increment, by body."""
        self.set_increments(self._u - fraction[:, None] * self._last)

    def linked(self) -> Indices:
        """For each body, the smallest number of those that are near each other or joined by springs."""
        joined = line_springs.joined(self.springs)
        both = joined if self.contact is None else np.concatenate([joined, self.contact.near.both()])
        return connected_parts(both[:, 0], both[:, 1], len(self.bodies))

    def rounded(self) -> Array:
        """Magnitudes that are rounded: displacement plus size for positions [m], one for rotations."""
        sizes = np.ones((len(self.bodies), 6))
        sizes[:, :3] = np.array([[np.abs(now.shift).max()] for now in self.now]) + self.extents[:, None]
        return self._by_component(sizes)[: self.size]

    def add_rounding(self, error: Array) -> None:
        """Add rounding errors that the flow causes in the balance, by owned unknown; call it after `linearise`."""
        assert self._noise is not None
        self._noise = self._noise + error

    def only_rounding(self) -> NDArray[np.bool_]:
        """Whether the balance of each body is rounding errors, where this step linearised last (collective)."""
        if self._noise is None:
            self.linearise()
        missed, noise = self.balance, self._from_owner(self._noise)  # type: ignore[arg-type]
        if self.contact is not None:
            missed, noise = missed - self.contact.force, noise + self.contact.rounding()
        return (np.abs(missed) <= noise).reshape(len(self.bodies), -1).all(axis=1)

    def worst(self) -> tuple[float, ...] | None:
        """Position [m] of the centre of the body with the largest residual."""
        index = int(np.abs(np.nan_to_num(self.balance, nan=np.inf)).reshape(len(self.bodies), -1).max(axis=1).argmax())
        return tuple((self.bodies[index].inertia.centre + self.now[index].shift[: self.dim]).tolist())

    # ------------------------------------------------------------------------------------- rows of a larger system

    def rigid_unknowns(self) -> Indices:
        """Numbers of all unknowns that are not held."""
        return self.first + np.flatnonzero(self._free)

    def row_transformations(self) -> list[RowTransformation]:
        with supported():
            change = None if self.contact is None else self.contact.transformation()
        return [] if change is None else [replace(change, dofs=self.first + change.dofs)]

    def recover(self, taken: Sequence[TakenRows], du: Array) -> None:
        """Nothing to do: the next evaluation of the balance computes the contact forces."""

    def added_product(self) -> None:
        """`linearise` is the whole derivative."""

    def missing(self) -> Array:
        """Zero: held components have their values since the start of the step."""
        return np.zeros(self.size)

    def impose_rows(self, blocks: Sequence[PETSc.Mat], x: Array, b: Array) -> list[PETSc.Mat]:
        """Replace the rows of held components by du = x. blocks: one row of blocks, its own first."""
        changed = list(blocks)
        rows = np.flatnonzero(~self._free[: self.size]).astype(PETSc.IntType)
        for index, block in enumerate(changed):
            block.zeroRows(rows + PETSc.IntType(self.first), 1.0 if index == 0 else 0.0)
        b[rows] = x[rows]
        return changed

    # ------------------------------------------------------------------------------------------- results and state

    def contact_pressure(self) -> float:
        """Largest traction of contact [Pa]: rigid bodies have none."""
        return 0.0

    def in_contact(self) -> bool:
        """Whether any contact is closed."""
        return self.contact is not None and bool(self.contact.active.any())

    def touching(self) -> NDArray[np.bool_] | None:
        return None if self.contact is None else self.contact.touching()

    def numbers(self) -> dict[str, float]:
        """With contact: vertices that touch, and the contact force on each body [N], averaged over the step."""
        if self.contact is None:
            return {}
        w = self._pressed_weight
        total = self.contact.whole_force + w * self.pressed + (1.0 - w) * self.pressed_old
        return self.contact.numbers(total.reshape(len(self.bodies), -1)[:, : self.dim])

    def save(self) -> State:
        parts = {body.name: now.arrays() for body, now in zip(self.bodies, self.now, strict=True)}
        loads = {"on_surface": self.on_surface.copy(), "pressed": self.pressed.copy()}
        return {"bodies": parts, **loads, "exchanged": self._exchanged}

    def restore(self, state: State) -> None:
        parts, self._exchanged = state["bodies"], state["exchanged"]
        self.now = [RigidInstant(**{k: a.copy() for k, a in parts[body.name].items()}) for body in self.bodies]
        self.on_surface, self.pressed = state["on_surface"].copy(), state["pressed"].copy()
