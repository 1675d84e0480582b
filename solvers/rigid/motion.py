"""The time scheme of rigid bodies: generalised-alpha for momentum and angular momentum.

With P = (m v, R J W), the momentum of the centre and the angular momentum about it in space (R: rotation, J: inertia,
W: spin, both in the body), and its rate p, a step of length dt by u = (dc, theta) from (c_n, R_n) is

    c = c_n + dc,  R = exp [theta] R_n                                       u_B = (dc, R_n^T theta)
    (v, W) = gamma / (beta dt) u_B + (1 - gamma / beta) (v, W)_n + dt (1 - gamma / (2 beta)) (a, A)_n
    p = (P - P_n) / (gamma dt) - (1 - gamma) / gamma p_n,                    a = p / m,  J A = R^T p - W x J W
    (1 - alpha_m) p + alpha_m p_n = (1 - alpha_f) f + alpha_f f_n

For the centre this is Chung and Hulbert's method. Without moments, p = 0 and the angular momentum R J W is conserved
exactly. With rho_inf = 1 the energy W . J W is conserved too, because W - W_n = J^-1 (R^T - R_n^T) R J W and theta is
the axis of R R_n^T.
A body with a pivot has the same equations about the pivot, at rest, with the inertia about it (`inertia.about`).
Source: for rho_inf = 1 Simo, Wong, Int. J. Numer. Meth. Engng 31 (1991) 19-52.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, FailureKind, Step, StepFailed, StepInfo
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.rigid.body import RigidBody
from solvers.rigid.rotation import rotation, skew, vector_rate

#: Angle [rad] of one step from which rotation vectors are ambiguous.
HALF_TURN = np.pi


@dataclass(frozen=True)
class RigidInstant:
    """The state of one body at one time."""

    shift: Array  #: displacement [m] of the centre since the start of the run, shape (3,)
    R: Array  #: rotation since then, shape (3, 3)
    v: Array  #: velocity [m/s] of the centre, spin [rad/s] in the body, shape (6,)
    p: Array  #: rate of the momentum, in space [N, N m], shape (6,)
    load: Array  #: force and moment about the centre in space, without contact, shape (6,)

    @classmethod
    def at_rest(cls) -> RigidInstant:
        return cls(np.zeros(3), np.eye(3), np.zeros(6), np.zeros(6), np.zeros(6))

    def arrays(self) -> dict[str, Array]:
        """Copies by name."""
        return {part.name: getattr(self, part.name).copy() for part in fields(self)}


def spin(now: RigidInstant) -> Array:
    """Angular velocity in space [rad/s], shape (3,)."""
    return now.R @ now.v[3:]


def momentum(body: RigidBody, R: Array, v: Array) -> Array:
    """P: momentum [kg m/s] and angular momentum about the centre [kg m^2/s], shape (6,)."""
    return np.concatenate([body.inertia.mass * v[:3], R @ body.inertia.tensor @ v[3:]])


def mass(body: RigidBody, R: Array) -> Array:
    """Mass matrix for the velocity of the centre and the angular velocity in space [kg, kg m^2], shape (6, 6)."""
    found = np.zeros((6, 6))
    found[:3, :3], found[3:, 3:] = body.inertia.mass * np.eye(3), R @ body.inertia.tensor @ R.T
    return found


def gyroscopic(body: RigidBody, now: RigidInstant) -> Array:
    """Part of the rate of momentum at constant velocity and spin, w x J w in space [N, N m], shape (6,)."""
    W = now.v[3:]
    return np.concatenate([np.zeros(3), now.R @ np.cross(W, body.inertia.tensor @ W)])


def turned_on(body: RigidBody, old: RigidInstant, now: RigidInstant) -> Array:
    """Momentum at the start of a step less that of the same velocities in space at its end [N s, N m s], shape (6,)."""
    velocity = np.concatenate([old.v[:3], spin(old)])
    return momentum(body, old.R, old.v) - mass(body, now.R) @ velocity


def kinetic_energy(body: RigidBody, now: RigidInstant) -> float:
    """Kinetic energy [J]."""
    return 0.5 * float(body.inertia.mass * now.v[:3] @ now.v[:3] + now.v[3:] @ body.inertia.tensor @ now.v[3:])


def acceleration(body: RigidBody, now: RigidInstant) -> Array:
    """Accelerations: a of the centre [m/s^2], A of the rotation in the body [rad/s^2], shape (6,); zero in statics."""
    if body.inertia.mass == 0.0:
        return np.zeros(6)
    J, W = body.inertia.tensor, now.v[3:]
    return np.concatenate([now.p[:3] / body.inertia.mass, np.linalg.solve(J, now.R.T @ now.p[3:] - np.cross(W, J @ W))])


def at_start(body: RigidBody, t: float, dt: float) -> RigidInstant:
    """Velocities and load of a body at the first time t [s], still without rates of momentum; dt [s]: the first step.

    The velocities of held components are those of their functions.
    """
    v, held, h = np.zeros(6), body.held_components, 1e-3 * dt
    v[: len(body.initial_velocity)] = body.initial_velocity
    v[3 : 3 + len(body.initial_spin)] = body.initial_spin
    x = [body.held_at(t + k * h) for k in range(3)]
    rest = RigidInstant.at_rest()
    load = body.own_load(t, rest.shift, rest.R, v[:3], v[3:])
    v[held] = (-3.0 * x[0] + 4.0 * x[1] - x[2]) / (2.0 * h)
    return replace(rest, v=v, load=load)


def with_rates(body: RigidBody, now: RigidInstant, t: float, dt: float) -> RigidInstant:
    """The state at the first time t [s] with the rates of momentum by its load.

    Those of held components belong to their accelerations and, by products of inertia, to the motion of the others.
    """
    held, h, p = body.held_components, 1e-3 * dt, now.load.copy()
    if body.inertia.mass == 0.0:
        return now
    if len(held) == 0:
        return replace(now, p=p)
    M, spinning, a = mass(body, now.R), spin(now), np.zeros(6)
    gyroscopic = np.concatenate([np.zeros(3), np.cross(spinning, M[3:, 3:] @ spinning)])
    x = [body.held_at(t + k * h) for k in range(4)]
    a[held] = (2.0 * x[0] - 5.0 * x[1] + 4.0 * x[2] - x[3]) / h**2
    free = np.setdiff1d(np.arange(6), held)
    a[free] = np.linalg.solve(M[np.ix_(free, free)], (now.load - gyroscopic - M @ a)[free])
    p[held] = (M @ a + gyroscopic)[held]
    return replace(now, p=p)


def moved(body: RigidBody, scheme: GeneralisedAlpha, old: RigidInstant, u: Array, t: float, dt: float) -> RigidInstant:
    """State after a step of length dt to the time t [s] by the increment u = (dc, theta), shape (6,)."""
    R = rotation(u[3:]) @ old.R
    shift = old.shift + u[:3]
    in_body = np.concatenate([u[:3], old.R.T @ u[3:]])
    v = scheme.velocity(in_body, old.v, acceleration(body, old), dt)
    change = momentum(body, R, v) - momentum(body, old.R, old.v)
    p = change / (scheme.gamma * dt) - (1.0 - scheme.gamma) / scheme.gamma * old.p
    return RigidInstant(shift, R, v, p, body.own_load(t, shift, R, v[:3], R @ v[3:]))


def velocity_rate(scheme: GeneralisedAlpha, old: RigidInstant, now: RigidInstant, theta: Array, dt: float) -> Array:
    """Derivative of (v, angular velocity in space) by dc and a further rotation w in space, shape (6, 6)."""
    rate = scheme.gamma / (scheme.beta * dt)
    by_w = rate * now.R @ old.R.T @ vector_rate(theta) - skew(spin(now))
    return np.block([[rate * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), by_w]])


def velocity_rates(
    scheme: GeneralisedAlpha, old: Sequence[RigidInstant], now: Sequence[RigidInstant], theta: Array, dt: float
) -> list[Array]:
    """`velocity_rate` of each body; theta: rotation vectors in the step, shape (bodies, 3)."""
    return [velocity_rate(scheme, then, end, turn, dt) for then, end, turn in zip(old, now, theta, strict=True)]


def with_motion(now: RigidInstant, components: NDArray[np.int64], velocity: Array, rate: Array) -> RigidInstant:
    """The instant with another velocity [m/s, rad/s] in space, and rate of momentum [N, N m], in these components."""
    v, p = np.zeros(6), now.p.copy()
    v[components], p[components] = velocity, rate
    v[3:] = now.R.T @ v[3:]
    return replace(now, v=v, p=p)


def own_tangent(
    body: RigidBody, scheme: GeneralisedAlpha, old: RigidInstant, now: RigidInstant, theta: Array, t: float, dt: float
) -> Array:
    """Derivative of (1 - alpha_m) p - (1 - alpha_f) f, f: own loads, by dc and a further rotation, shape (6, 6)."""
    rate = velocity_rate(scheme, old, now, theta, dt)
    loads = body.own_load_tangent(t, now.shift, now.R, now.v[:3], spin(now), rate)
    return inertia_tangent(body, scheme, old, now, theta, dt) - (1.0 - scheme.alpha_f) * loads


def without_held(blocks: Array, free: NDArray[np.bool_]) -> Array:
    """Blocks of bodies with rows and columns of the identity for held unknowns; free: mask of all unknowns."""
    free = free.reshape(blocks.shape[:2])
    kept = np.where(free[:, :, None] & free[:, None, :], blocks, 0.0)
    return kept + np.where(free, 0.0, 1.0)[:, :, None] * np.eye(free.shape[1])


def own_tangents(
    bodies: Sequence[RigidBody],
    scheme: GeneralisedAlpha,
    old: Sequence[RigidInstant],
    now: Sequence[RigidInstant],
    theta: Array,
    step: Step,
) -> Array:
    """`own_tangent` of each body, shape (bodies, 6, 6); theta: rotation vectors in the step, shape (bodies, 3)."""
    parts = zip(bodies, old, now, theta, strict=True)
    return np.array([own_tangent(body, scheme, then, end, turn, step.t, step.dt) for body, then, end, turn in parts])


def inertia_tangent(
    body: RigidBody, scheme: GeneralisedAlpha, old: RigidInstant, now: RigidInstant, theta: Array, dt: float
) -> Array:
    """Derivative of (1 - alpha_m) p by dc and a further rotation w in space, shape (6, 6)."""
    share, rate = (1.0 - scheme.alpha_m) / (scheme.gamma * dt), scheme.gamma / (scheme.beta * dt)
    J, angular = body.inertia.tensor, momentum(body, now.R, now.v)[3:]
    by_w = rate * now.R @ J @ old.R.T @ vector_rate(theta) - skew(angular)
    tangent = np.zeros((6, 6))
    tangent[:3, :3] = share * rate * body.inertia.mass * np.eye(3)
    tangent[3:, 3:] = share * by_w
    return tangent


def require_short_turns(field: str, bodies: Sequence[RigidBody], u: Array, info: StepInfo) -> None:
    """Raise StepFailed for a body that rotates by half a turn or more in a step; u: increments, shape (bodies, 6)."""
    for body, own in zip(bodies, u, strict=True):
        if not np.linalg.norm(own[3:]) < HALF_TURN:
            reason = f"body '{body.name}' turned by more than half a turn: take a smaller time step"
            raise StepFailed(field, FailureKind.MOTION, reason, iteration=info.iterations, history=info.residuals)
