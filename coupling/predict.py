"""Extrapolation of displacements: the parabola through the last three, or the line or constant through fewer.

d(t) = sum_i L_i(t) d_i with the Lagrange polynomials L_i on the times t_i. Steps may have different lengths.
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
        """Add displacements [m] at the time t [s], which is later than all before."""
        self.times, self.displacements = [t, *self.times][:3], [d.copy(), *self.displacements][:3]

    def at(self, t: float) -> Array:
        """Extrapolated displacements [m] at the time t [s]."""
        predicted = np.zeros_like(self.displacements[0])
        for i, (time, displacement) in enumerate(zip(self.times, self.displacements, strict=True)):
            others = [other for j, other in enumerate(self.times) if j != i]
            predicted += float(np.prod([(t - other) / (time - other) for other in others])) * displacement
        return predicted
