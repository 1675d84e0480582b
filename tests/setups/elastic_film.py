"""Rebound of an elastic ball from a wall by lubrication theory: Reynolds' equation with a layer, half-space, contact.

Davis, Serayssol and Hinch (J. Fluid Mech. 163 (1986) 479) with the layer of rough surfaces and contact. Axisymmetric:

    dh/dt = div((h^3 + R^3) / (12 mu) grad p),  h = x + r^2 / (2 a) + w,  0 <= h, 0 <= P, h P = 0,
    w(r) = int 4 s K(m) / (pi E* (r + s)) (p + P)(s) ds,  m = 4 r s / (r + s)^2,
    M dv/dt = int p + P - 6 pi mu a (Brenner's factor - a / x) v,  dx/dt = v,  M: mass of the ball and added mass.

Inertia of the fluid counts as added mass only; there is no wake and no boundary layer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from lubrication import sphere_drag
from numpy.typing import NDArray
from scipy.special import ellipk

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Impact:
    """A ball; diameter, velocity at the start and density of the fluid are 1."""

    stokes: float  #: density / (9 viscosity)
    density: float = 8.0
    modulus: float = 5e5 / (1 - 0.3**2)  #: E* = E / (1 - nu^2)
    roughness: float = 1e-3  #: R
    start: float = 0.05  #: gap at the start, where both velocities are read
    added_mass: float = 0.0  #: over the mass of the displaced fluid


def lost(start: float, end: float, roughness: float = 0.0) -> float:
    """St times the velocity that a rigid ball loses in the film between two gaps: int F dx / (6 pi mu a^2 v).

    ln(start / end) without a layer. With one the force of the film is finite; to a gap of 0 (start far above R)

        2 int_0^start dx int_x^inf (g - x) / (g^3 + R^3) dg = ln(start / R) + 3/2.
    """
    if roughness == 0.0:
        return float(np.log(start / end))
    assert end == 0.0
    return float(np.log1p((start / roughness) ** 3) / 3.0 + 1.5)


def rings(count: int = 100, end: float = 6.0, fine: float = 0.03) -> Array:
    """Radii between rings, from 0: fine near the axis."""
    radii: Array = fine * np.sinh(np.linspace(0.0, 1.0, count + 1) * np.arcsinh(end / fine))
    return radii


def compliance(edges: Array, modulus: float) -> Array:
    """w at the middle of the rings by the pressure in each, shape (n, n) [m/Pa]."""
    r = (edges[1:] + edges[:-1]) / 2
    places, weights = np.polynomial.legendre.leggauss(4)
    part = edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.0, 1.0, 9)  # 8 parts of each ring
    half = np.diff(part)[..., None] / 2
    s = ((part[:, 1:] + part[:, :-1])[..., None] / 2 + half * places).reshape(len(r), -1)
    ds = (half * weights).reshape(len(r), -1)
    both = r[:, None, None] + s
    m = np.minimum(4 * r[:, None, None] * s / both**2, 1 - 1e-14)
    w: Array = (4 * s / both * ellipk(m) * ds).sum(axis=2) / (np.pi * modulus)
    return w


def rebound(ball: Impact, dt: float = 2.5e-4, count: int = 100, end: float = 1.0) -> Array:
    """Time, x and v of each step, until the ball is back at the start or stands still, shape (steps, 3).

    Motion by the trapezoidal rule, the film by backward Euler; Newton's method with active sets in each step.
    """
    a, M = 0.5, np.pi / 6 * (ball.density + ball.added_mass)
    mu, R = ball.density / (9 * ball.stokes), ball.roughness
    edges = rings(count)
    r, areas = (edges[1:] + edges[:-1]) / 2, np.pi * np.diff(edges**2)
    A, c, n, inner = compliance(edges, ball.modulus), ball.modulus / a, count, np.arange(count - 1)
    widths = 2 * np.pi * edges[1:-1] / (12 * mu * np.diff(r))
    gaps = np.geomspace(1e-4, 0.2, 60)
    outer = 6 * np.pi * mu * a * np.array([sphere_drag(x / a) - a / x for x in gaps])
    p, P, x, v, force, t = np.zeros(n), np.zeros(n), ball.start, -1.0, 0.0, 0.0
    h, steps = x + r**2 / (2 * a), [(0.0, x, v)]
    rim = np.pi * edges[-1] * h[-1] ** 3 / (6 * mu * (edges[-1] - r[-1]))  # p = 0 there
    while t < end and (v <= 0.0 or x < ball.start) and not (v < 0.0 < max(step[2] for step in steps)):
        before, x0, v0 = h, x, v
        for iteration in range(60):
            h = x + r**2 / (2 * a) + A @ (p + P)
            middle = np.maximum((h[1:] + h[:-1]) / 2, 0.0)
            G, slope = widths * (middle**3 + R**3), widths * 1.5 * middle**2 * np.diff(p)
            L, S = np.zeros((n, n)), np.zeros((n, n))
            for row, sign in ((inner, -1.0), (inner + 1, 1.0)):
                L[row, inner + 1] += sign * G
                L[row, inner] -= sign * G
                S[row, inner] += sign * slope
                S[row, inner + 1] += sign * slope
            L[-1, -1] += rim
            D = float(np.interp(x, gaps, outer))
            closed = P > c * h
            of_film = areas * (h - before) / dt + L @ p
            of_contact = np.where(closed, -c * h, -P)
            of_motion = M * (v - v0) / dt - (areas @ (p + P) + force) / 2 + D * (v + v0) / 2
            by_h = np.diag(areas / dt) + S
            J = np.zeros((2 * n + 2, 2 * n + 2))
            J[:n, :n], J[:n, n : 2 * n], J[:n, 2 * n] = by_h @ A + L, by_h @ A, by_h.sum(axis=1)
            J[n : 2 * n, :n] = np.where(closed[:, None], -c * A, 0.0)
            J[n : 2 * n, n : 2 * n] = np.where(closed[:, None], -c * A, -np.eye(n))
            J[n : 2 * n, 2 * n] = np.where(closed, -c, 0.0)
            J[2 * n, : 2 * n], J[2 * n, -1] = -np.tile(areas, 2) / 2, M / dt + D / 2
            J[-1, 2 * n], J[-1, -1] = 1.0, -dt / 2
            residual = np.concatenate([of_film, of_contact, [of_motion, x - x0 - dt * (v + v0) / 2]])
            change = np.linalg.solve(J, -residual)
            p, P, x, v = p + change[:n], P + change[n : 2 * n], x + change[2 * n], v + change[-1]
            if iteration and np.abs(change[: 2 * n]).max() < 1e-7 * max(1.0, np.abs(p).max()):
                break
        else:
            raise ArithmeticError(f"no convergence at {t:g}")
        h, force, t = x + r**2 / (2 * a) + A @ (p + P), float(areas @ (p + P)), t + dt
        steps.append((t, x, v))
    return np.array(steps)


def restitution(ball: Impact, **settings: float) -> float:
    """Velocity back at the start over that before; 0 if the ball does not come back."""
    x, v = rebound(ball, **settings)[:, 1:].T  # type: ignore[arg-type]
    return float(np.interp(ball.start, x[-2:], v[-2:])) if x[-1] >= ball.start and v[-1] > 0 else 0.0
