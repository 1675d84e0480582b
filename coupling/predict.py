"""Extrapolation of displacements: the parabola through the last three, or the line or constant through fewer.

d(t) = sum_i L_i(t) d_i, L_i the Lagrange polynomials on the times t_i, whatever the lengths of the steps were.
"""

from __future__ import annotations

import numpy as np

from solvers.api import Array


class Predictor:
    """The last displacements, newest first, three at most."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self.displacements: list[Array] = []

    def add(self, t: float, d: Array) -> None:
        """Displacements [m] at time t [s], later than all before."""
        self.times, self.displacements = [t, *self.times][:3], [d.copy(), *self.displacements][:3]

    def at(self, t: float) -> Array:
        """Displacements [m] expected at time t [s]."""
        predicted = np.zeros_like(self.displacements[0])
        for i, (time, displacement) in enumerate(zip(self.times, self.displacements, strict=True)):
            others = [other for j, other in enumerate(self.times) if j != i]
            predicted += float(np.prod([(t - other) / (time - other) for other in others])) * displacement
        return predicted
