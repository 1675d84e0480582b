"""Rigid motions that formulas of time prescribe."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fsci.case.fluid import Movement
from fsci.expression import Expression
from fsci.mesh import rotation_matrix

Array = NDArray[np.float64]


def rigid_motion(points: Array, movement: Movement, dt: float) -> Callable[[float], tuple[Array, Array]]:
    """t -> (positions [m], velocities [m/s]), each of the shape (n, dim) of the points at rest [m].

    x = c + R(angle) (X - c) + d and v = d' + angle' k x (x - d - c), with rates of the formulas by differences over
    a hundredth of the time step dt: for motions that such steps resolve, exact to about ten digits.
    """
    dim, turn = points.shape[1], movement.rotation
    shift = movement.displacement or ()
    centre = np.zeros(dim) if turn is None else np.array(turn.centre)

    def motion(t: float) -> tuple[Array, Array]:
        displaced = np.array([value(formula, t) for formula in shift]) if shift else np.zeros(dim)
        velocity = np.array([rate(formula, t, dt) for formula in shift]) if shift else np.zeros(dim)
        if turn is None:
            return points + displaced, np.broadcast_to(velocity, points.shape).copy()
        arms = (points - centre) @ rotation_matrix(turn.axis, value(turn.angle, t), dim).T
        spin = np.radians(rate(turn.angle, t, dt))
        axis = np.array([0.0, 0.0, 1.0] if turn.axis is None else turn.axis)
        swept = np.cross(spin * axis / np.linalg.norm(axis), np.pad(arms, ((0, 0), (0, 3 - dim))))[:, :dim]
        return centre + arms + displaced, velocity + swept

    return motion


def value(formula: Expression, t: float) -> float:
    """A formula of time at a time."""
    return float(formula(np.zeros((3, 1)), t)[0])


def rate(formula: Expression, t: float, dt: float) -> float:
    """Its derivative, by the central difference of fourth order over 0.01 dt."""
    if formula.constant is not None:
        return 0.0
    h = 0.01 * dt
    near, far = (value(formula, t + n * h) - value(formula, t - n * h) for n in (1, 2))
    return (8.0 * near - far) / (12.0 * h)
