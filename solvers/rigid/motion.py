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
Source: for rho_inf = 1 Simo, Wong, Int. J. Numer. Meth. Engng 31 (1991) 19-52.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from solvers.api import Array
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.rigid.body import RigidBody
from solvers.rigid.rotation import rotation, skew, vector_rate


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


def kinetic_energy(body: RigidBody, now: RigidInstant) -> float:
    """Kinetic energy [J]."""
    return 0.5 * float(body.inertia.mass * now.v[:3] @ now.v[:3] + now.v[3:] @ body.inertia.tensor @ now.v[3:])


def acceleration(body: RigidBody, now: RigidInstant) -> Array:
    """Accelerations: a of the centre [m/s^2], A of the rotation in the body [rad/s^2], shape (6,)."""
    J, W = body.inertia.tensor, now.v[3:]
    return np.concatenate([now.p[:3] / body.inertia.mass, np.linalg.solve(J, now.R.T @ now.p[3:] - np.cross(W, J @ W))])


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
