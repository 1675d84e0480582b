"""How the structure moves in time: not at all (load steps), or by the generalised-alpha method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array
from solvers.blocks import block_diagonal
from solvers.structure.held import Held
from solvers.structure.instant import Instant, Moving
from solvers.structure.massless import massless_dofs, move_mass_inwards
from solvers.time import GeneralisedAlpha

#: Time, in first steps, in which velocities and accelerations at the start are measured.
SHORT = 1e-3


class Settling(Moving, Protocol):
    """A structure whose first state a scheme can have found."""

    def settle(self, time: TimeScheme, held: Held, t: float, dt: float) -> None:
        """A step to the same t by another scheme and with other supports. Raises StepFailed."""
        ...


class TimeScheme(Protocol):
    """What a time scheme adds to f_int - f_ext."""

    @property
    def force_weight(self) -> float:
        """Weight of the forces at the end of the step in the balance; those at its start have the rest."""
        ...

    def mass(self, structure: Moving) -> PETSc.Mat:
        """The mass matrix [kg] of all bodies. Raises NoMassLeft."""
        ...

    def start(self, structure: Settling, t: float, dt: float) -> None:
        """Prepare; velocity and acceleration at the start."""
        ...

    def predict(self, structure: Moving, dt: float) -> None:
        """First iterate of a step of size dt."""
        ...

    def balance(self, structure: Moving) -> Array:
        """The residual [N] at the present iterate; velocity and acceleration follow the displacement."""
        ...

    def averaged_load(self, structure: Moving) -> Array:
        """The balance [N] without loads by another field, all forces averaged over the step."""
        ...

    def tangent(self, structure: Moving, stiffness: PETSc.Mat) -> PETSc.Mat:
        """d(balance)/du from the static stiffness, which may be overwritten."""
        ...

    def reaction(self, structure: Moving) -> Array:
        """The out-of-balance force [N] at the present time: what the supports hold."""
        ...

    def averaged_forces(self, structure: Moving) -> tuple[Array, Array]:
        """(external, damping) force [N] of the step's balance."""
        ...

    def kinetic_energy(self, structure: Moving) -> float:
        """v.M v / 2 [J]."""
        ...


class Statics:
    """f_int(u) = f_ext(t): every time step is a load step."""

    force_weight = 1.0

    def mass(self, structure: Moving) -> PETSc.Mat:
        return block_diagonal([body.mass() for body in structure.bodies])

    def start(self, structure: Settling, t: float, dt: float) -> None: ...
    def predict(self, structure: Moving, dt: float) -> None: ...

    def balance(self, structure: Moving) -> Array:
        return self.reaction(structure)

    def averaged_load(self, structure: Moving) -> Array:
        return structure.now.internal - structure.now.loads - structure.now.constraint

    def tangent(self, structure: Moving, stiffness: PETSc.Mat) -> PETSc.Mat:
        return stiffness

    def reaction(self, structure: Moving) -> Array:
        return structure.now.internal - structure.now.external - structure.now.constraint

    def averaged_forces(self, structure: Moving) -> tuple[Array, Array]:
        external = 0.5 * (structure.now.external + structure.old.external)
        return external, np.zeros_like(external)

    def kinetic_energy(self, structure: Moving) -> float:
        return 0.0


class FirstState(Statics):
    """f_int(u) + C v = f_ext(t): the first state of nodes without mass, which move from u_0 in a short time dt.

    Without damping they are at once where the forces on them are in balance. With damping they are still where they
    were, and v = (u - u_0) / dt is the velocity with which they start. v of the others is given.
    """

    def __init__(self, moving: NDArray[np.int64], damping: PETSc.Mat | None, dt: float):
        """moving: owned dofs without mass."""
        self._moving, self._damping, self._dt = moving, damping, dt

    def balance(self, structure: Moving) -> Array:
        force = self.reaction(structure)
        if self._damping is None:
            return force
        now, (v, damping) = structure.now, self._damping.createVecs()
        now.v[self._moving] = (now.u - structure.old.u)[self._moving] / self._dt
        v.array[:] = now.v
        self._damping.mult(v, damping)
        return force + damping.array

    def tangent(self, structure: Moving, stiffness: PETSc.Mat) -> PETSc.Mat:
        if self._damping is not None:
            stiffness.axpy(1.0 / self._dt, self._damping, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        return stiffness


@dataclass(frozen=True)
class Damping:
    """Rayleigh damping C = mass * M + stiffness * K(u = 0)."""

    mass: float = 0.0  #: [1/s]
    stiffness: float = 0.0  #: [s]


class Dynamics:
    """Generalised-alpha: M a_{1-alpha_m} + C v_{1-alpha_f} + (1 - alpha_f) f_{n+1} + alpha_f f_n = 0.

    The forces f = f_int - f_ext - f_contact are averaged, not evaluated in the middle.

    Contact surfaces have no mass. Their rows are static balances at n+1, times 1 - alpha_f: the old forces there are in
    balance and drop out; if they were not, they would ring for ever. Their velocity is (u_{n+1} - u_n) / dt.
    """

    def __init__(
        self,
        scheme: GeneralisedAlpha,
        *,
        damping: Damping = Damping(),
        predictor: Literal["constant_displacement", "constant_velocity"] = "constant_displacement",
    ):
        self.scheme, self.damping, self.predictor = scheme, damping, predictor
        self.force_weight = 1.0 - scheme.alpha_f
        self._massless = np.empty(0, dtype=np.int64)
        self._dt = 0.0
        self._damping_matrix: PETSc.Mat | None = None
        self._effective: PETSc.Mat | None = None
        self._effective_dt = 0.0

    # ------------------------------------------------------------------------------------------------- start

    def mass(self, structure: Moving) -> PETSc.Mat:
        matrices = [body.mass() for body in structure.bodies]
        if structure.constraint is None:
            return block_diagonal(matrices)
        massless = massless_dofs(structure)
        self._massless = np.flatnonzero(np.concatenate(massless))
        for i, body in enumerate(structure.bodies):
            change, points = matrices[i], body.points[: body.dim, : body.owned].T
            matrices[i] = move_mass_inwards(change, massless[i], points)
            change.aypx(-1.0, matrices[i], PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
            body.move_mass(change)
        return block_diagonal(matrices)

    def start(self, structure: Settling, t: float, dt: float) -> None:
        """Places of nodes without mass, then M a_0 = -C v_0 - f_0; prescribed dofs follow their functions.

        A load on a node without mass acts on those with mass by internal forces alone. If these were not in balance
        with it at t, the part of its impulse that belongs to the start of the first step would be lost.
        """
        self._work = structure.mass.createVecs("right"), structure.mass.createVecs("left")
        self._damping_matrix = self._assemble_damping(structure)
        self._effective = None
        self._start_supports(structure, t, SHORT * dt)
        if structure.comm.allreduce(len(self._massless)):
            first = FirstState(self._massless, self._damping_matrix, SHORT * dt)
            others = np.setdiff1d(np.arange(structure.layout.size), self._massless)
            structure.settle(first, structure.held.stopped(others, structure.now.u), t, SHORT * dt)
        self._solve_acceleration(structure)

    def _assemble_damping(self, structure: Moving) -> PETSc.Mat | None:
        if self.damping == Damping():
            return None
        damping = structure.mass.copy()
        damping.scale(self.damping.mass)
        if self.damping.stiffness:
            damping.axpy(self.damping.stiffness, _initial_stiffness(structure))
        return damping

    def _start_supports(self, structure: Moving, t: float, h: float) -> None:
        """One-sided differences, so that a support that starts to move does not ring."""
        held, now = structure.held, structure.now
        u = [held.displacement(t + k * h) for k in range(4)]
        now.v[:] = held.free_part(now.v) + (-3.0 * u[0] + 4.0 * u[1] - u[2]) / (2.0 * h)
        now.a[:] = held.free_part(now.a) + (2.0 * u[0] - 5.0 * u[1] + 4.0 * u[2] - u[3]) / h**2

    def _solve_acceleration(self, structure: Moving) -> None:
        now, (x, b) = structure.now, self._work
        b.array[:] = now.external + now.constraint - now.internal - self._damping_force(now.v)
        x.array[:] = now.a
        x.array[self._massless] = 0.0
        matrix = structure.held.impose(structure.mass.copy(), x, b)
        rows = (structure.layout.start + self._massless).astype(PETSc.IntType)
        matrix.zeroRowsColumns(rows, 1.0, x, b)
        ksp = PETSc.KSP().create(structure.comm)
        ksp.setOperators(matrix)
        ksp.setType(PETSc.KSP.Type.CG)
        ksp.getPC().setType(PETSc.PC.Type.JACOBI)
        ksp.setTolerances(rtol=1e-15, atol=0.0, max_it=1000)
        ksp.solve(b, x)
        now.a[:] = x.array

    # ------------------------------------------------------------------------------------------------- steps

    def predict(self, structure: Moving, dt: float) -> None:
        """Displacement unchanged, or moved on with the velocity."""
        self._dt = dt
        if self.predictor == "constant_velocity":
            structure.now.u += dt * structure.held.free_part(structure.now.v)

    def balance(self, structure: Moving) -> Array:
        scheme, dt, now, old = self.scheme, self._dt, structure.now, structure.old
        du = now.u - old.u
        now.a = scheme.acceleration(du, old.v, old.a, dt)
        now.v = scheme.velocity(du, old.v, old.a, dt)
        now.a[self._massless], now.v[self._massless] = 0.0, du[self._massless] / dt
        present, before = (self._own_forces(at) - at.surface for at in (now, old))
        before[self._massless] = 0.0
        return self._inertia(structure) + (1.0 - scheme.alpha_f) * present + scheme.alpha_f * before

    def averaged_load(self, structure: Moving) -> Array:
        present, before = (self._own_forces(at) for at in (structure.now, structure.old))
        return self._inertia(structure) + (1.0 - self.scheme.alpha_f) * present + self.scheme.alpha_f * before

    def _inertia(self, structure: Moving) -> Array:
        share = self.scheme.alpha_m
        return self._times(structure.mass, (1.0 - share) * structure.now.a + share * structure.old.a)

    def _own_forces(self, at: Instant) -> Array:
        return at.internal - at.loads - at.constraint + self._damping_force(at.v)

    def averaged_forces(self, structure: Moving) -> tuple[Array, Array]:
        alpha, now, old = self.scheme.alpha_f, structure.now, structure.old
        external = (1.0 - alpha) * now.external + alpha * old.external
        return external, self._damping_force((1.0 - alpha) * now.v + alpha * old.v)

    def tangent(self, structure: Moving, stiffness: PETSc.Mat) -> PETSc.Mat:
        """(1 - alpha_f) K + mass_factor M + damping_factor C."""
        same = PETSc.Mat.Structure.SAME_NONZERO_PATTERN
        if self._effective is None or self._effective_dt != self._dt:
            self._effective = structure.mass.copy()
            self._effective.scale(self.scheme.mass_factor(self._dt))
            if self._damping_matrix is not None:
                self._effective.axpy(1.0, self._damping_tangent(), same)
            self._effective_dt = self._dt
        stiffness.scale(1.0 - self.scheme.alpha_f)
        stiffness.axpy(1.0, self._effective, same)
        return stiffness

    def _damping_tangent(self) -> PETSc.Mat:
        """d(damping force)/du [N/m]."""
        assert self._damping_matrix is not None
        matrix, (slope, _) = self._damping_matrix.copy(), self._work
        slope.array[:] = self.scheme.damping_factor(self._dt)
        slope.array[self._massless] = (1.0 - self.scheme.alpha_f) / self._dt
        matrix.diagonalScale(None, slope)
        return matrix

    def reaction(self, structure: Moving) -> Array:
        """M a + C v + f_int - f_ext at the present time."""
        now = structure.now
        dynamic = self._times(structure.mass, now.a) + self._damping_force(now.v)
        return dynamic + now.internal - now.external - now.constraint

    def kinetic_energy(self, structure: Moving) -> float:
        return 0.5 * structure.comm.allreduce(float(structure.now.v @ self._times(structure.mass, structure.now.v)))

    def _damping_force(self, v: Array) -> Array:
        return np.zeros_like(v) if self._damping_matrix is None else self._times(self._damping_matrix, v)

    def _times(self, matrix: PETSc.Mat, array: Array) -> Array:
        x, y = self._work
        x.array[:] = array
        matrix.mult(x, y)
        return y.array.copy()


def _initial_stiffness(structure: Moving) -> PETSc.Mat:
    matrices = []
    for body, u in zip(structure.bodies, structure.layout.split(structure.now.u), strict=True):
        body.set_displacement(np.zeros_like(u))
        matrices.append(body.create_tangent())
        body.assemble_tangent(matrices[-1])
        body.set_displacement(u)
    return block_diagonal(matrices)
