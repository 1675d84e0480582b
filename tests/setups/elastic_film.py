"""Rebound of an elastic ball from a wall by lubrication theory: Reynolds' equation with a layer, half-space, contact.

Davis, Serayssol and Hinch (J. Fluid Mech. 163 (1986) 479) with the layer of rough surfaces and contact. Axisymmetric:

    dh/dt = div((h^3 + R^3) / (12 mu) grad p),  h = x + r^2 / (2 a) + w,  0 <= h, 0 <= P, h P = 0,
    w(r) = int 4 s K(m) / (pi E* (r + s)) (p + P)(s) ds,  m = 4 r s / (r + s)^2,
    M dv/dt + M' v^2 / 2 = int p + P - 6 pi mu a (Brenner's factor - a / x) v - B,  dx/dt = v,
    B = 6 a^2 (pi rho mu)^(1/2) c int dv/ds / (t - s)^(1/2) ds.

M(x): mass of the ball and added mass beside a wall (Lamb, Hydrodynamics, sections 98 and 138), both on request.
B: history force (Basset) of boundary layers thinner than the ball. By potential flow it is proportional to int of the
slip^2 over the walls: c = 1 far from the wall, and more beside it (`slip_at_walls`). There is no wake. The film itself
has no inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from lubrication import sphere_drag
from numpy.typing import NDArray
from scipy.integrate import trapezoid
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
    inertia: bool = False  #: added mass
    history: float = 0.0  #: c


def lost(start: float, end: float, roughness: float = 0.0) -> float:
    """St times the velocity that a rigid ball loses in the film between two gaps: int F dx / (6 pi mu a^2 v).

    ln(start / end) without a layer. With one the force of the film is finite; to a gap of 0 (start far above R)

        2 int_0^start dx int_x^inf (g - x) / (g^3 + R^3) dg = ln(start / R) + 3/2.
    """
    if roughness == 0.0:
        return float(np.log(start / end))
    assert end == 0.0
    return float(np.log1p((start / roughness) ** 3) / 3.0 + 1.5)


def images(gap: float, a: float = 0.5) -> Array:
    """Dipoles in a ball that moves towards a wall in potential flow: strength over the first, distance from the centre.

    Each one's mirror image behind the wall, at the distance d, has an image of (a / d)^3 times its strength at a^2 / d.
    """
    strength, below, found = 1.0, 0.0, []
    while strength > 1e-9:
        found.append((strength, below))
        d = 2.0 * (a + gap) - below
        strength, below = strength * (a / d) ** 3, a * a / d
    return np.array(found)


def added_mass(gap: float) -> float:
    """Of a ball that moves towards a wall, over the mass of the displaced fluid: 1/2 far away, 0.803 at contact."""
    return float(0.5 * (3.0 * images(gap)[:, 0].sum() - 2.0))


def slip_at_walls(gap: float, film: float = 0.0, a: float = 0.5) -> float:
    """int of slip^2 over the ball and the wall in potential flow, over 6 pi a^2 v^2; without the film r < `film`."""

    def flow(r: Array, z: Array) -> Array:
        total = np.zeros((2, len(r)))
        for strength, below in images(gap, a):
            for place, sign in ((a + gap - below, 1.0), (below - a - gap, -1.0)):
                y, far = z - place, r**2 + (z - place) ** 2
                part = np.array([-3.0 * y * r / far**2.5, far**-1.5 - 3.0 * y**2 / far**2.5])
                total += sign * strength * a**3 / 2.0 * part
        return total

    angle = np.linspace(1e-4, np.pi - 1e-4, 4001)
    r, n = a * np.sin(angle), np.array([np.sin(angle), -np.cos(angle)])
    relative = flow(r, a + gap + a * n[1]) + np.array([[0.0], [1.0]])
    slip = (relative**2).sum(axis=0) - (relative * n).sum(axis=0) ** 2
    ball = trapezoid(slip * 2.0 * np.pi * r * ((r > film) | (n[1] > 0.0)), a * angle)
    r = np.geomspace(max(film, 1e-4), 20.0, 4001)
    wall = trapezoid(flow(r, 0.0 * r)[0] ** 2 * 2.0 * np.pi * r, r)
    return float((ball + wall) / (6.0 * np.pi * a**2))


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
    a, displaced = 0.5, np.pi / 6
    mu, R = ball.density / (9 * ball.stokes), ball.roughness
    edges = rings(count)
    r, areas = (edges[1:] + edges[:-1]) / 2, np.pi * np.diff(edges**2)
    A, c, n, inner = compliance(edges, ball.modulus), ball.modulus / a, count, np.arange(count - 1)
    widths = 2 * np.pi * edges[1:-1] / (12 * mu * np.diff(r))
    gaps = np.geomspace(1e-4, 0.2, 60)
    outer = 6 * np.pi * mu * a * np.array([sphere_drag(x / a) - a / x for x in gaps])
    masses = displaced * np.array([ball.density + (added_mass(x) if ball.inertia else 0.0) for x in gaps])
    basset, jumps = 6 * a**2 * np.sqrt(np.pi * mu) * ball.history, [0.0]
    p, P, x, v, force, t = np.zeros(n), np.zeros(n), ball.start, -1.0, 0.0, 0.0
    if ball.inertia:
        v *= displaced * ball.density / float(np.interp(x, gaps, masses))
    jumps[0] = v
    h, steps = x + r**2 / (2 * a), [(0.0, x, v)]
    rim = np.pi * edges[-1] * h[-1] ** 3 / (6 * mu * (edges[-1] - r[-1]))  # p = 0 there
    while t < end and (v <= 0.0 or x < ball.start) and not (v < 0.0 < max(step[2] for step in steps)):
        before, x0, v0 = h, x, v
        M, age = float(np.interp(x, gaps, masses)), np.arange(len(jumps), 0.0, -1.0)
        # jumps of the steps before, their kernel averaged over this one
        outside = basset * 2.0 / np.sqrt(dt) * float(np.array(jumps) @ (np.sqrt(age) - np.sqrt(age - 1.0)))
        if ball.inertia:
            outside += float(np.diff(np.interp([x - 1e-4, x + 1e-4], gaps, masses))[0]) / 2e-4 * v**2 / 2.0
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
            of_motion = M * (v - v0) / dt - (areas @ (p + P) + force) / 2 + D * (v + v0) / 2 + outside
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
        jumps.append(v - v0)
    return np.array(steps)


def restitution(ball: Impact, read: float = 0.05, **settings: float) -> float:
    """Velocity at a gap after contact over that before; 0 if the ball does not come back to it."""
    x, v = rebound(ball, **settings)[:, 1:].T  # type: ignore[arg-type]
    lowest = int(x.argmin())
    before = float(np.interp(-read, -x[: lowest + 1], v[: lowest + 1]))
    return -float(np.interp(read, x[lowest:], v[lowest:], right=0.0)) / before
