"""The generalised-alpha method for structures, with Rayleigh damping and massless contact surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.added_product import with_product
from solvers.algebra.blocks import times
from solvers.algebra.linear import reason_of
from solvers.api import Array, FailureKind, StepFailed
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.first_state import FirstState
from solvers.structure.instant import Instant, MovingStructure
from solvers.structure.mass_exchange import exchange
from solvers.structure.massless import massless_dofs
from solvers.structure.rayleigh import Damping, RayleighDamping
from solvers.structure.time_scheme import ExchangingStructure, SettlingStructure

#: Interval of the finite differences at the start, relative to the first step.
SHORT = 1e-3


@dataclass(frozen=True)
class Dynamics:
    """Generalised-alpha: M a_{1-alpha_m} + C v_{1-alpha_f} + (1 - alpha_f) f_{n+1} + alpha_f f_n = 0.

    The forces f = f_int - f_ext - f_contact are averaged over the ends of the step, not evaluated in between. The rows
    of contact surfaces, which have no mass, are static balances at n+1, multiplied by 1 - alpha_f; the velocity of
    their dofs is (u_{n+1} - u_n) / dt. A piece that touches with nodes that have mass is integrated by implicit Euler,
    M (v_{n+1} - v_n) / dt + f_{n+1} = 0, multiplied by 1 - alpha_f (docs/theory_contact.md, Dynamics).
    """

    scheme: GeneralisedAlpha
    damping: Damping = Damping()
    predictor: Literal["constant_displacement", "constant_velocity"] = "constant_displacement"

    @property
    def force_weight(self) -> float:
        return 1.0 - self.scheme.alpha_f

    # ------------------------------------------------------------------------------------------------- start

    def massless(self, structure: MovingStructure) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        if structure.constraint is None:
            return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
        massless, impulsive = massless_dofs(structure)
        return np.flatnonzero(massless), np.flatnonzero(impulsive)

    def create_damping(self, structure: MovingStructure) -> RayleighDamping | None:
        return None if self.damping == Damping() else RayleighDamping(self.damping, structure)

    def start(self, structure: SettlingStructure, t: float, dt: float) -> None:
        """Solve for the positions of massless nodes, then M a_0 = -C v_0 - f_0; prescribed dofs follow their functions.

        A load on a massless node acts on the others by internal forces only. Without this equilibrium at t, part of the
        impulse in the first step would be lost.
        """
        self._start_supports(structure, t, SHORT * dt)
        if structure.comm.allreduce(len(structure.inertia.find_massless())):
            others = np.setdiff1d(np.arange(structure.layout.size), structure.inertia.find_massless())
            held = structure.held.stopped(others, structure.now.u)
            with structure.by(FirstState(damped=structure.damping is not None), held, t, SHORT * dt):
                structure.solve()
        structure.now.mean[:] = structure.now.v
        self._solve_acceleration(structure)

    def _start_supports(self, structure: MovingStructure, t: float, h: float) -> None:
        """Velocities and accelerations of supports by one-sided differences, so that they excite no oscillations."""
        held, now = structure.held, structure.now
        u = [held.displacement(t + k * h) for k in range(4)]
        now.v[:] = held.free_part(now.v) + (-3.0 * u[0] + 4.0 * u[1] - u[2]) / (2.0 * h)
        now.a[:] = held.free_part(now.a) + (2.0 * u[0] - 5.0 * u[1] + 4.0 * u[2] - u[3]) / h**2

    def _solve_acceleration(self, structure: MovingStructure) -> None:
        """M a_0 = f_ext - f_int - C v_0, prescribed where supports are. Raises StepFailed."""
        now, rigid, frame, held = structure.now, structure.inertia.find_rigid(), structure.inertia.frame, structure.held
        x, b = structure.inertia.assemble_mass().createVecs()
        if structure.damping is not None:
            now.damping[:] = structure.damping.force(now.v)
        b.array[:] = now.external + now.constraint - now.internal - now.damping
        x.array[:] = now.a
        x.array[structure.inertia.find_massless()] = 0.0
        if rigid is not None and frame is not None:
            b.array[:] -= rigid.force_by_acceleration(frame, now.v, held.part(x.array))
        matrix = held.impose(structure.inertia.assemble_mass().copy(), x, b)
        rows = (structure.layout.start + structure.inertia.find_massless()).astype(PETSc.IntType)
        matrix.zeroRowsColumns(rows, 1.0, x, b)
        ksp = PETSc.KSP().create(structure.comm)
        if rigid is None or frame is None:
            ksp.setOperators(matrix)
        else:
            product = rigid.product(frame)
            more = with_product(matrix, lambda a: held.free_part(product(held.free_part(a))))
            ksp.setOperators(more, matrix)
        ksp.setType(PETSc.KSP.Type.CG)
        ksp.getPC().setType(PETSc.PC.Type.JACOBI)
        ksp.setTolerances(rtol=1e-15, atol=0.0, max_it=1000)
        ksp.solve(b, x)
        if ksp.getConvergedReason() < 0:
            finite = np.isfinite(b.norm())
            kind = FailureKind.LINEAR_SOLVER if finite else FailureKind.NOT_FINITE
            why = reason_of(ksp) if finite else "a force is not a number"
            raise StepFailed("structure", kind, f"the acceleration at the start cannot be computed ({why})")
        now.a[:], now.rigid[:] = x.array, 0.0
        if rigid is not None and frame is not None:
            now.rigid[:] = rigid.force_by_acceleration(frame, now.v, now.a)

    # ------------------------------------------------------------------------------------------------- steps

    def prepare(self, structure: ExchangingStructure, t: float, dt: float) -> None:
        """Exchange mass if other contact pairs may come together in this step."""
        constraint = structure.constraint
        if constraint is None or not structure.exchanges_mass:
            return
        u, v = (structure.at_constraint(array) for array in (structure.now.u, structure.now.v))
        present = constraint.find_present(u, v, t, dt)
        if np.array_equal(present, constraint.present):
            return
        constraint.begin_step()  # what the last step has kept is no part of the saved state

        def switch() -> None:
            constraint.present = present

        def settle(lighter: NDArray[np.int64]) -> None:
            others = np.setdiff1d(np.arange(structure.layout.size), lighter)
            held = structure.held.stopped(others, structure.now.u)
            with structure.by(FirstState(damped=structure.damping is not None), held, t, SHORT * dt):
                structure.solve()

        exchange(structure, switch, settle)
        structure.assemble()
        self._solve_acceleration(structure)

    def guess(self, structure: MovingStructure, dt: float) -> Array:
        """Zero, or the velocity times dt."""
        if self.predictor == "constant_displacement":
            return np.zeros(structure.layout.size)
        return dt * structure.held.free_part(structure.now.v)

    def motion(self, structure: MovingStructure, dt: float) -> tuple[Array, Array]:
        """Newmark's relations; for massless and impulsive dofs v = (u_{n+1} - u_n) / dt.

        With damping massless dofs have v = w + (w - w_n) dt / (dt + dt_n), w = (u_{n+1} - u_n) / dt and w_n that of the
        last step, of second order at the end of the step (the backward difference of three positions). In the first
        step w_n is the velocity at its start, and dt_n = 0. Where contact may begin or end, v = w: velocities jump, and
        the damping would throw the body back.
        """
        old, massless, impulsive = structure.old, structure.inertia.find_massless(), structure.inertia.find_impulsive()
        du = structure.now.u - old.u
        a, v = (rule(du, old.v, old.a, dt) for rule in (self.scheme.acceleration, self.scheme.velocity))
        w = du[massless] / dt
        a[massless], v[massless] = 0.0, w + structure.extrapolation[massless] * (w - old.mean[massless])
        v[impulsive] = du[impulsive] / dt
        a[impulsive] = (v - old.v)[impulsive] / dt
        return v, a

    def extrapolation(self, structure: ExchangingStructure, t: float, dt: float) -> Array:
        """dt / (dt + dt_n) at owned dofs; zero where contact acts or may begin in this step, and without damping.

        Without damping the velocities of massless dofs do nothing. The start of the step decides: if contact at its end
        did, the force would jump where contact closes, and a coupled step could have no solution.
        """
        constraint, old = structure.constraint, structure.old
        factor = np.zeros(structure.layout.size)
        if structure.damping is None or constraint is None or not structure.inertia.moves_mass():
            return factor
        factor[:] = dt / (dt + structure.last_length)
        u, v = (structure.at_constraint(array) for array in (old.u, old.v))
        factor[structure.layout.among_owned(constraint.approaching_dofs(u, v, t, dt))[1]] = 0.0
        pushed = (old.constraint.reshape(-1, structure.dim) != 0.0).any(axis=1)
        factor[np.repeat(pushed, structure.dim)] = 0.0
        return factor

    def rigid_force(self, structure: MovingStructure, dt: float) -> Array:
        now, inertia = structure.now, structure.inertia
        rigid, frame, before = inertia.find_rigid(), inertia.frame, inertia.momenta
        if rigid is None or frame is None or before is None:
            return now.rigid
        return rigid.force(frame, now.v, now.a, before, dt, self.scheme.gamma)

    def rigid_factor(self, dt: float) -> float:
        return self.scheme.mass_factor(dt) + self.damping.mass * self.scheme.damping_factor(dt)

    def balance(self, structure: MovingStructure) -> Array:
        present, before = (self._own_forces(structure, at) - at.surface for at in (structure.now, structure.old))
        before[structure.inertia.find_massless()] = before[structure.inertia.find_impulsive()] = 0.0
        return self._inertia(structure, 0.0) + (1.0 - self.scheme.alpha_f) * present + self.scheme.alpha_f * before

    def averaged_load(self, structure: MovingStructure) -> Array:
        present, before = (self._own_forces(structure, at) for at in (structure.now, structure.old))
        alpha = self.scheme.alpha_f
        return self._inertia(structure, alpha) + (1.0 - alpha) * present + alpha * before

    def _inertia(self, structure: MovingStructure, old_share: float) -> Array:
        """The mean force of inertia; old_share: weight of that at the start of the step at impulsive dofs."""
        share, now, old = self.scheme.alpha_m, structure.now, structure.old
        impulsive = structure.inertia.find_impulsive()
        a = (1.0 - share) * now.a + share * old.a
        a[impulsive] = (1.0 - self.scheme.alpha_f) * now.a[impulsive] + old_share * old.a[impulsive]
        return times(structure.inertia.assemble_mass(), a) + (1.0 - share) * now.rigid + share * old.rigid

    def averaged(self, before: Array, after: Array) -> Array:
        return (1.0 - self.scheme.alpha_f) * after + self.scheme.alpha_f * before

    def damping_force(self, structure: MovingStructure) -> Array:
        return self.averaged(structure.old.damping, structure.now.damping)

    def _own_forces(self, structure: MovingStructure, at: Instant) -> Array:
        return at.internal - at.loads - at.constraint + at.damping

    def dynamic_stiffness(self, structure: MovingStructure, dt: float) -> PETSc.Mat:
        """mass_factor M, in rows of impulsive dofs (1 - alpha_f) / dt^2 M."""
        matrix, (factor, _) = structure.inertia.assemble_mass().copy(), structure.inertia.assemble_mass().createVecs()
        factor.array[:] = self.scheme.mass_factor(dt)
        factor.array[structure.inertia.find_impulsive()] = (1.0 - self.scheme.alpha_f) / dt**2
        matrix.diagonalScale(factor, None)
        return matrix

    def damping_slope(self, structure: MovingStructure, dt: float) -> Array | None:
        slope = np.full(structure.layout.size, self.scheme.damping_factor(dt))
        slope[structure.inertia.find_impulsive()] = (1.0 - self.scheme.alpha_f) / dt
        massless = structure.inertia.find_massless()
        slope[massless] = (1.0 - self.scheme.alpha_f) * (1.0 + structure.extrapolation[massless]) / dt
        return slope

    def reaction(self, structure: MovingStructure) -> Array:
        """M a + C v + f_int - f_ext [N] at the present time."""
        now = structure.now
        dynamic = times(structure.inertia.assemble_mass(), now.a) + now.rigid + now.damping
        return dynamic + now.internal - now.external - now.constraint

    def support_forces(self, structure: MovingStructure) -> tuple[Array, Array]:
        """The balance of the step at both ends; at massless and impulsive dofs those of its ends."""
        inertia, found = structure.inertia, (structure.residual_force.copy(), structure.residual_force.copy())
        for force, at in zip(found, (structure.old, structure.now), strict=True):
            static = self._own_forces(structure, at) - at.surface
            massless, impulsive = inertia.find_massless(), inertia.find_impulsive()
            force[massless] = static[massless]
            if len(impulsive):
                force[impulsive] = (static + times(inertia.assemble_mass(), at.a))[impulsive]
        return found

    @property
    def dissipates(self) -> bool:
        return (self.scheme.alpha_m, self.scheme.alpha_f) != (0.5, 0.5)

    def stopping_force(self, structure: MovingStructure) -> Array:
        old, share = structure.old, self.scheme.alpha_m
        stopped = self.scheme.acceleration(np.zeros_like(old.u), old.v, old.a, structure.current.dt)
        return times(structure.inertia.assemble_mass(), (1.0 - share) * stopped + share * old.a)

    def kinetic_energy(self, structure: MovingStructure) -> float:
        return structure.inertia.energy(structure.now.v)
