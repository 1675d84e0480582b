"""Rigid motions prescribed by functions of time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from fsci.case.fluid import Movement, Turn
from fsci.expression import Expression
from fsci.rotation import rotation_matrix
from solvers.api import FailureKind, StepFailed

Array = NDArray[np.float64]
ValueAndRate = Callable[[float], tuple[float, float]]  #: t -> (value, its rate)

#: The difference of fourth order from here to four points after.
FORWARD = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0

GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)


def rigid_motion(
    points: Array, movement: Movement, start: float, dt: float, jumps: Sequence[float] = ()
) -> Callable[[float], tuple[Array, Array]]:
    """t -> (positions [m], velocities [m/s]), each of the shape (n, dim) of the points at rest [m].

    x = c + R(angle) (X - c) + d and v = d' + angle' k x (x - d - c); start and dt: first time and step of the run [s];
    jumps: times at which velocities may jump, in order.
    """
    dim, turn = points.shape[1], movement.rotation
    shift = [differentiated(formula, dt, jumps) for formula in movement.displacement or ()]
    shift += [integrated(formula, start, dt, jumps) for formula in movement.velocity or ()]
    centre = np.zeros(dim) if turn is None else np.array(turn.centre)
    angle = None if turn is None else _angle(turn, start, dt, jumps)

    def motion(t: float) -> tuple[Array, Array]:
        displaced, velocity = np.array([component(t) for component in shift]).T if shift else np.zeros((2, dim))
        if turn is None or angle is None:
            return points + displaced, np.broadcast_to(velocity, points.shape).copy()
        turned, rate = angle(t)
        arms = (points - centre) @ rotation_matrix(turn.axis, turned, dim).T
        axis = np.array([0.0, 0.0, 1.0] if turn.axis is None else turn.axis)
        spin = np.radians(rate) * axis / np.linalg.norm(axis)
        swept = np.cross(spin, np.pad(arms, ((0, 0), (0, 3 - dim))))[:, :dim]
        return centre + arms + displaced, velocity + swept

    return motion


def finite(motion: Callable[[float], tuple[Array, Array]], name: str) -> Callable[[float], tuple[Array, Array]]:
    """The motion of a body; a call raises StepFailed, on all processes alike, where it is not finite."""

    def moved(t: float) -> tuple[Array, Array]:
        x, v = motion(t)
        if not (np.isfinite(x).all() and np.isfinite(v).all()):
            raise StepFailed(
                "fluid", FailureKind.NOT_FINITE, f"the motion of body '{name}' is not a number at t = {t:.6g}"
            )
        return x, v

    return moved


def _angle(turn: Turn, start: float, dt: float, jumps: Sequence[float]) -> ValueAndRate:
    if turn.angular_velocity is not None:
        return integrated(turn.angular_velocity, start, dt, jumps)
    assert turn.angle is not None
    return differentiated(turn.angle, dt, jumps)


def differentiated(formula: Expression, dt: float, jumps: Sequence[float] = ()) -> ValueAndRate:
    """The formula and its rate, by the central difference of fourth order over a hundredth of the time step.

    For motions that such steps resolve, the rate is exact to about ten digits. Beside a jump of the rate, it is that
    on the side of t; at a jump, that after it.
    """
    h = 0.01 * dt

    def value_and_rate(t: float) -> tuple[float, float]:
        if formula.constant is not None:
            return float(formula.constant), 0.0
        for jump in jumps:
            if abs(t - jump) < 2.0 * h:
                return one_sided(t, after=t >= jump)
        values = formula.at_times(t + h * np.arange(-2, 3))
        if not np.isfinite(values).all():
            return one_sided(t)
        back2, back, here, on, on2 = values
        return float(here), float((8.0 * (on - back) - (on2 - back2)) / (12.0 * h))

    def one_sided(t: float, *, after: bool = True) -> tuple[float, float]:
        """From the values after t, or before; also of a formula that begins or ends here, as t**1.5 at 0."""
        later, earlier = formula.at_times(t + h * np.arange(5)), formula.at_times(t - h * np.arange(5))
        rate = FORWARD @ later if after and np.isfinite(later).all() else -(FORWARD @ earlier)
        return float(later[0]), float(rate / h)

    return value_and_rate


def integrated(formula: Expression, start: float, dt: float, jumps: Sequence[float] = ()) -> ValueAndRate:
    """The integral of the formula from `start` on, and the formula: Gauss's rule with eight points in each time step.

    Exact for polynomials up to degree 15 in each step, and on both sides of jumps.
    """
    sums = np.zeros(1)  # at the ends of the steps up to the latest time of a call

    def integral(begin: float, end: float) -> float:
        ends = np.array([begin, *(jump for jump in jumps if begin < jump < end), end])
        return float(_gauss(formula, ends[:-1], ends[1:]).sum())

    def value_and_rate(t: float) -> tuple[float, float]:
        nonlocal sums
        steps = max(int((t - start) / dt), 0)
        if steps >= len(sums):
            new = [integral(start + dt * k, start + dt * (k + 1)) for k in range(len(sums) - 1, steps)]
            sums = np.concatenate([sums, sums[-1] + np.cumsum(new)])
        return float(sums[steps] + integral(start + dt * steps, t)), float(formula.at_times(t))

    return value_and_rate


def _gauss(formula: Expression, begin: Array, end: Array) -> Array:
    """Integrals of the formula from `begin` to `end`, both of the shape (n,)."""
    half = (end - begin) / 2.0
    times = ((begin + end) / 2.0)[:, None] + half[:, None] * GAUSS_POINTS
    return half * (formula.at_times(times) @ GAUSS_WEIGHTS)
