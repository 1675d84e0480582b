"""Rigid bodies as a field: six unknowns for each body, three in 2D, in one balance of forces and moments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array, State, StepFailed, StepInfo
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Tolerance, converge
from solvers.rigid import motion
from solvers.rigid.body import RigidBody, in_space
from solvers.rigid.contact import RigidContact
from solvers.rigid.motion import RigidInstant
from solvers.rigid.rotation import vector_rate
from solvers.rounding import rounding_error
from solvers.rows import RowTransformation, TakenRows
from solvers.step import Step
from solvers.timing import Timer
from solvers.vertices import VertexJacobian

#: Ways to move that count as unknowns, by dimension of space.
UNKNOWNS = {2: np.array([0, 1, 5]), 3: np.arange(6)}

#: Angle [rad] of one step from which rotation vectors are ambiguous.
HALF_TURN = np.pi


class RigidBodies:
    """A `Solid`: all bodies are whole on every process; the first one owns the unknowns.

    The unknowns of a body are increments of its position in a step: displacement of the centre [m] and a rotation about
    the axes of space [rad]. `held` components are given, others follow from the balance of forces and moments.
    """

    name = "rigid bodies"

    def __init__(
        self,
        bodies: Sequence[RigidBody],
        scheme: GeneralisedAlpha = GeneralisedAlpha.from_rho_inf(1.0),
        tolerance: Tolerance = Tolerance(),
        *,
        contact: RigidContact | None = None,
        timer: Timer | None = None,
        comm: MPI.Comm = MPI.COMM_WORLD,
    ):
        self.bodies, self.scheme, self.tolerance = list(bodies), scheme, tolerance
        self.comm, self.timer, self.contact = comm, timer or Timer(), contact
        self.dim, self.extents = bodies[0].dim, np.array([body.extent for body in bodies])
        self.components = UNKNOWNS[self.dim]
        self.unknowns = len(bodies) * len(self.components)  #: of all processes
        self.size = self.unknowns if comm.rank == 0 else 0
        self.surfaces = {body.name: body.points for body in bodies}
        self.now = [RigidInstant.at_rest() for _ in bodies]
        self.old = list(self.now)
        self.on_surface = np.zeros((len(bodies), 6))  #: force and moment by the flow [N, N m], now
        self.on_surface_old = np.zeros((len(bodies), 6))
        self._forces = [np.zeros((len(body.points), self.dim)) for body in bodies]  #: on the vertices [N]
        self._u, self._last = np.zeros((len(bodies), 6)), np.zeros((len(bodies), 6))
        self._held_u = np.zeros((len(bodies), 6))  #: increments of the held components in this step
        self.current = Step(0.0, 0.0)  #: the step that is computed now or was last
        free = np.ones((len(bodies), 6), dtype=bool)
        for index, body in enumerate(bodies):
            free[index, body.held_components] = False
        self._free = free[:, self.components].ravel()
        self.balance = np.zeros(self.unknowns)
        self._noise: Array | None = None  #: rounding errors of the balance, as far as this step knows

    # ------------------------------------------------------------------------------------------------- steps

    @property
    def force_weight(self) -> float:
        return 1.0 - self.scheme.alpha_f

    def initialise(self, t: float, dt: float) -> None:
        """Initial velocities, and the accelerations that are in balance with the loads at t."""
        for index, body in enumerate(self.bodies):
            v = np.zeros(6)
            v[: len(body.initial_velocity)] = body.initial_velocity
            v[3 : 3 + len(body.initial_spin)] = body.initial_spin
            start = RigidInstant.at_rest()
            load = body.own_load(t, start.shift, start.R, v[:3], v[3:])
            rate, held, h = load.copy(), body.held_components, 1e-3 * dt
            x = [body.held_at(t + k * h) for k in range(4)]
            v[held] = (-3.0 * x[0] + 4.0 * x[1] - x[2]) / (2.0 * h)
            course = (2.0 * x[0] - 5.0 * x[1] + 4.0 * x[2] - x[3]) / h**2
            rate[held] = np.diag(motion.mass(body, start.R))[held] * course
            self.now[index] = RigidInstant(start.shift, start.R, v, rate, load)
        self.old = list(self.now)

    def step(self, t: float, dt: float) -> StepInfo:
        """One step from t to t + dt without a flow. Raises StepFailed."""
        self.begin_step(t, dt)
        self.predict(t + dt)
        info = self.solve()
        self.end_step()
        return info

    def begin_step(self, t: float, dt: float, held: Array | None = None) -> None:
        """Remember the state at t; held components are those of t + dt, or go these ways, shape (bodies, 6)."""
        self.old, self.on_surface_old = list(self.now), self.on_surface.copy()
        self.current, self._noise = Step(t + dt, dt), None
        self._u[:] = self._held_u[:] = 0.0
        for index, (u, body) in enumerate(zip(self._held_u, self.bodies, strict=True)):
            way = body.held_at(t + dt) - body.held_at(t) if held is None else held[index, body.held_components]
            u[body.held_components] = way
        self.place(self._held_u)

    def predict(self, t: float) -> None:
        """Free components go on with their velocity."""
        u, path = self._held_u.copy(), self.current.dt * self._velocity(self.old)
        u[:, self.components] += np.where(self._free, path, 0.0).reshape(len(u), -1)
        self.place(u)

    def place(self, u: Array) -> None:
        """Go to the increments u since the start of the step, shape (bodies, 6)."""
        self._u = u
        self.now = [
            motion.moved(body, self.scheme, old, part, self.current.t, self.current.dt)
            for body, old, part in zip(self.bodies, self.old, u, strict=True)
        ]

    def solve(self) -> StepInfo:
        """Newton to the tolerance under the load there is. Raises StepFailed."""
        info = converge(self, self.tolerance)
        self.check(info)
        return info

    def check(self, info: StepInfo) -> None:
        """Raise StepFailed for a body that turns by half a turn in a step."""
        for body, u in zip(self.bodies, self._u, strict=True):
            if not np.linalg.norm(u[3:]) < HALF_TURN:
                reason = f"body '{body.name}' turned by more than half a turn: take a smaller time step"
                raise StepFailed(self.name, reason, iteration=info.iterations, history=info.residuals)

    def end_step(self) -> None:
        """Accept the step; an impact takes velocity away."""
        self.balance = self._own_balance()
        if self.contact is None or not self.contact.active.any():
            return
        mass = np.zeros((self.unknowns, self.unknowns))
        n = len(self.components)
        for index, (body, now) in enumerate(zip(self.bodies, self.now, strict=True)):
            rows = slice(index * n, (index + 1) * n)
            mass[rows, rows] = motion.mass(body, now.R)[np.ix_(self.components, self.components)]
        before, weight = self._velocity(self.old), self.force_weight
        force, force_before = (
            self._by_component(np.array([one.load for one in some]) + by_flow)
            for some, by_flow in ((self.now, self.on_surface), (self.old, self.on_surface_old))
        )
        pushed = np.linalg.solve(mass, weight * force + (1.0 - weight) * force_before)
        without = np.where(self._free, before + self.current.dt * pushed, self._velocity(self.now))
        velocity, rate = self.contact.after_impact(mass, before, without, force)
        rate = np.where(self._free, rate, self._by_component(np.array([now.p for now in self.now])))
        for index, now in enumerate(self.now):
            rows = slice(index * n, (index + 1) * n)
            v, p = np.zeros(6), now.p.copy()
            v[self.components], p[self.components] = velocity[rows], rate[rows]
            v[3:] = now.R.T @ v[3:]
            self.now[index] = replace(now, v=v, p=p)

    def _velocity(self, instants: Sequence[RigidInstant]) -> Array:
        """Velocities of the centres [m/s] and spins in space [rad/s], of all unknowns."""
        return self._by_component(np.array([np.concatenate([now.v[:3], motion.spin(now)]) for now in instants]))

    # ---------------------------------------------------------------------------------------------- the surface

    def _positions(self) -> list[Array]:
        """Of the vertices [m], by body, shape (n, dim)."""
        pairs = zip(self.bodies, self.now, strict=True)
        return [body.inertia.centre + (now.shift + body.arms(now.R, body.points))[:, : self.dim] for body, now in pairs]

    def displacement(self) -> Array:
        """Of all vertices [m], shape (n, dim)."""
        moved = zip(self.bodies, self._positions(), strict=True)
        return np.concatenate([x - body.points for body, x in moved])

    def jacobian(self) -> VertexJacobian:
        """A vertex moves by dc + w x r: k = 2 entries in 2D, 4 in 3D."""
        columns, values = [], []
        axes = np.arange(self.dim)
        turns = np.arange(self.dim, len(self.components))
        for index, (body, now) in enumerate(zip(self.bodies, self.now, strict=True)):
            r = body.arms(now.R, body.points)
            swept = np.cross(np.eye(3)[None, :, :], r[:, None, :])  # (n, axis of rotation, component)
            by_turn = swept[:, self.components[turns] - 3, : self.dim].transpose(0, 2, 1)
            first, n = index * len(self.components), len(r)
            columns.append(
                np.concatenate(
                    [
                        np.broadcast_to(first + axes[None, :, None], (n, self.dim, 1)),
                        np.broadcast_to(first + turns, (n, self.dim, len(turns))),
                    ],
                    axis=2,
                ).reshape(n * self.dim, -1)
            )
            values.append(np.concatenate([np.ones((n, self.dim, 1)), by_turn], axis=2).reshape(n * self.dim, -1))
        return VertexJacobian(np.concatenate(columns), np.concatenate(values))

    def load(self, force: Array) -> None:
        """Take the force [N] of the flow on all vertices, shape (n, dim)."""
        self._forces = np.split(force, np.cumsum([len(body.points) for body in self.bodies])[:-1])
        self.on_surface = self._resultants(self._forces)

    def _resultants(self, forces: Sequence[Array]) -> Array:
        """Forces and moments about the centres, shape (bodies, 6)."""
        found = []
        for body, now, given in zip(self.bodies, self.now, forces, strict=True):
            f = in_space(given)
            found.append(np.concatenate([f.sum(axis=0), np.cross(body.arms(now.R, body.points), f).sum(axis=0)]))
        return np.array(found)

    def reduced(self, force: Array) -> Array:
        """Forces [N] and moments [N m] of forces on the vertices, of all unknowns."""
        parts = np.split(force, np.cumsum([len(body.points) for body in self.bodies])[:-1])
        return self._by_component(self._resultants(parts))

    def taken(self) -> Array:
        """What momentum, own loads and contact leave open [N, N m]; for held components what was handed over."""
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
        """(1 - alpha_m) p + alpha_m p_n less the averaged own loads and the contact force, of all unknowns."""
        m, f = self.scheme.alpha_m, self.scheme.alpha_f
        parts = zip(self.now, self.old, strict=True)
        rows = [(1 - m) * now.p + m * old.p - (1 - f) * now.load - f * old.load for now, old in parts]
        balance = self._by_component(np.array(rows))
        return balance if self.contact is None else balance - self.contact.force

    def residual(self) -> float:
        """Norm [N] of the balance; moments count over the size of the body."""
        weight = self.force_weight
        mean = self._by_component(weight * self.on_surface + (1.0 - weight) * self.on_surface_old)
        if self.contact is not None:
            self.contact.z[:] = 0.0
        self.balance = np.where(self._free, self._own_balance() - mean, 0.0)
        if self.contact is None:
            return self._norm(self.balance)
        arms = [body.arms(now.R, body.points) for body, now in zip(self.bodies, self.now, strict=True)]
        self.contact.measure(self._positions(), arms, self.components, self.current.t)
        self.contact.G[:, ~self._free] = 0.0
        self.contact.press(self._system(), -self.balance)
        return self._norm(self.balance - self.contact.force)

    def _norm(self, rows: Array) -> float:
        arms = np.where(self.components < 3, 1.0, self.extents[:, None]).ravel()
        return float(np.linalg.norm(rows / arms))

    def tangent(self) -> Array:
        """d(balance)/d(unknowns), dense; what forces on the vertices turn with the body is in it."""
        found, n, weight = np.zeros((self.unknowns, self.unknowns)), len(self.components), self.force_weight
        parts = zip(self.bodies, self.old, self.now, self._u, self._forces, strict=True)
        for index, (body, old, now, u, force) in enumerate(parts):
            own = motion.inertia_tangent(body, self.scheme, old, now, u[3:], self.current.dt)
            rate = motion.velocity_rate(self.scheme, old, now, u[3:], self.current.dt)
            own -= weight * body.own_load_tangent(now.shift, now.R, now.v[:3], motion.spin(now), rate)
            arms = body.arms(now.R, body.points)
            turned = arms.T @ in_space(force)  # sum of [f] [r] = r f^T - (f . r) 1
            own[3:, 3:] -= weight * (turned - np.trace(turned) * np.eye(3))
            rows = slice(index * n, (index + 1) * n)
            found[rows, rows] = own[np.ix_(self.components, self.components)]
        return found

    def linearise(self) -> PETSc.Mat:
        """The same as a distributed matrix."""
        own = (self.size, None)
        matrix, values = PETSc.Mat().createAIJ((own, own), nnz=(self.unknowns, 0), comm=self.comm), self.tangent()
        if self.size:
            rows = np.arange(self.unknowns, dtype=PETSc.IntType)
            matrix.setValues(rows, rows, values)
        matrix.assemble()
        self._noise = rounding_error(matrix, self.rounded())
        return matrix

    def advance(self) -> float:
        """One Newton step; the size of the increment over that of the step."""
        right = -self.balance
        if self.contact is not None:
            right += self.contact.force
        return self._add(np.linalg.solve(self._system(), right))

    def _system(self) -> Array:
        """The tangent with rows and columns of the identity for held components."""
        matrix, held = self.tangent(), ~self._free
        matrix[held], matrix[:, held] = 0.0, 0.0
        matrix[held, held] = 1.0
        return matrix

    def right_side(self) -> Array:
        """Minus the balance, without the contact force."""
        return -self.balance[: self.size]

    def update(self, increment: Array) -> float:
        """Add increments of the owned unknowns; their size relative to the step."""
        return self._add(self.comm.bcast(increment.copy() if self.comm.rank == 0 else None, root=0))

    def _add(self, increment: Array) -> float:
        added = np.zeros_like(self._u)
        added[:, self.components] = np.where(self._free, increment, 0.0).reshape(len(added), -1)
        for part, u in zip(added, self._u, strict=True):
            part[3:] = vector_rate(u[3:]) @ part[3:]
        self._last = added
        self.place(self._u + added)
        size = np.linalg.norm(self._scaled(self._u))
        return float(np.linalg.norm(self._scaled(added)) / size) if size > 0.0 else 0.0

    def _scaled(self, u: Array) -> Array:
        """Displacements and rotations, these times the size of the body [m]."""
        return np.where(np.arange(6) < 3, 1.0, self.extents[:, None]) * u

    def retreat(self, fraction: float) -> None:
        """Take back a fraction of the last increment."""
        self.place(self._u - fraction * self._last)

    def settled(self) -> bool:
        """True: the residual vanishes only where gaps and pressures fit."""
        return True

    def rounded(self) -> Array:
        """Positions are known to eps times displacement and size [m], rotations to eps."""
        sizes = np.ones((len(self.bodies), 6))
        sizes[:, :3] = np.array([[np.abs(now.shift).max()] for now in self.now]) + self.extents[:, None]
        return self._by_component(sizes)[: self.size]

    def add_rounding(self, error: Array) -> None:
        """Rounding errors that the flow brings into the balance, after `linearise`, of the owned unknowns."""
        assert self._noise is not None
        self._noise = self._noise + error

    def round_off(self) -> float:
        """Norm [N] of the rounding error of the balance where it was linearised last in this step (collective)."""
        if self._noise is None:
            self.linearise()
        noise = self.comm.bcast(self._noise if self.comm.rank == 0 else None, root=0)
        return self._norm(np.where(self._free, noise, 0.0))

    def worst(self) -> tuple[float, ...] | None:
        """Centre [m] of the body with the largest residual."""
        norms = np.abs(np.nan_to_num(self.balance, nan=np.inf)).reshape(len(self.bodies), -1).max(axis=1)
        index = int(np.argmax(norms))
        return tuple((self.bodies[index].inertia.centre + self.now[index].shift[: self.dim]).tolist())

    # ------------------------------------------------------------------------------------- rows of a larger system

    def row_transformation(self) -> RowTransformation | None:
        return None if self.contact is None else self.contact.transformation(self._system())

    def recover(self, taken: TakenRows, du: Array) -> None:
        """Pressures follow from the balance where it is evaluated next."""

    def missing(self) -> Array:
        """Zero: held components have their values from the start of the step on."""
        return np.zeros(self.size)

    def impose_rows(self, blocks: Sequence[PETSc.Mat], x: Array, b: Array) -> list[PETSc.Mat]:
        """Rows of held components become du = x there; the first of the blocks beside each other is its own."""
        changed = list(blocks)
        rows = np.flatnonzero(~self._free[: self.size]).astype(PETSc.IntType)
        for index, block in enumerate(changed):
            block.zeroRows(rows, 1.0 if index == 0 else 0.0)
        b[rows] = x[rows]
        return changed

    # ------------------------------------------------------------------------------------------- results and state

    def touching(self) -> NDArray[np.bool_] | None:
        return None if self.contact is None else self.contact.active

    def numbers(self) -> dict[str, float]:
        return {} if self.contact is None else self.contact.numbers()

    def save(self) -> State:
        parts = {body.name: now.arrays() for body, now in zip(self.bodies, self.now, strict=True)}
        return {"bodies": parts, "on_surface": self.on_surface.copy()}

    def restore(self, state: State) -> None:
        self.now = [
            RigidInstant(**{k: a.copy() for k, a in state["bodies"][body.name].items()}) for body in self.bodies
        ]
        self.on_surface = state["on_surface"].copy()
