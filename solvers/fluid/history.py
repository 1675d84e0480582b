"""The velocities of the steps behind: how many there are decides how the next step takes its time derivative."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid import time

Mask = NDArray[np.bool_]


@dataclass
class Past:
    """Velocities [m/s] of a time behind, at local dofs, and where they are known."""

    velocity: Array
    valid: Mask


class History:
    """What BDF2 needs of two times behind, backward Euler of one.

    BDF2 starts with two steps of backward Euler: both keep its order, and after only one it would take back half of
    what a flow that starts at once gained in it.
    """

    def __init__(self, scheme: str, size: int):
        self.scheme = scheme
        #: at the end of the last accepted step, and at the two times that the present step takes its rate from
        self.now, self.old, self.older = (Past(np.zeros(size), np.ones(size, dtype=bool)) for _ in range(3))
        self.steps: tuple[float, ...] = ()  #: lengths [s] of the last accepted steps, two at most

    def begin_step(self, dt: float) -> time.Difference:
        """The time derivative in a step of length dt from now on."""
        self.older, self.old = self.old, self.now
        if self.scheme == "steady":
            return time.STEADY
        if self.scheme == "backward_euler" or len(self.steps) < 2:
            return time.backward_euler(dt)
        return time.bdf2(dt, self.steps[-1])

    def end_step(self, dt: float, velocity: Array, known: Mask) -> None:
        """Accept a step that found the flow at some local dofs."""
        self.now = Past(velocity, known)
        self.steps = (*self.steps, dt)[-2:]

    def rate(self, difference: time.Difference) -> Array:
        """What u_t takes from the times behind, beta_0 u_n + beta_1 u_{n-1} [m/s^2]."""
        return difference.beta_0 * self.old.velocity + difference.beta_1 * self.older.velocity

    def unknown(self, difference: time.Difference) -> Mask:
        """Where that asks for a velocity that no step has found."""
        unknown = np.zeros(len(self.old.valid), dtype=bool)
        for weight, past in ((difference.beta_0, self.old), (difference.beta_1, self.older)):
            if weight:
                unknown |= ~past.valid
        return unknown
