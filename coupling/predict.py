"""Where a body will be: the parabola through its last three places, or as much of it as is known.

d(t) = sum_i L_i(t) d_i, L_i the Lagrange polynomials on the times t_i, whatever the lengths of the steps were.
"""

from __future__ import annotations

import numpy as np

from solvers.api import Array


class Predictor:
    """The last places, newest first, three at most."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self.places: list[Array] = []

    def add(self, t: float, d: Array) -> None:
        """Displacements [m] at time t [s], later than all before."""
        self.times, self.places = [t, *self.times][:3], [d.copy(), *self.places][:3]

    def at(self, t: float) -> Array:
        """Displacements [m] expected at time t [s]."""
        predicted = np.zeros_like(self.places[0])
        for i, (time, place) in enumerate(zip(self.times, self.places, strict=True)):
            others = [other for j, other in enumerate(self.times) if j != i]
            predicted += float(np.prod([(t - other) / (time - other) for other in others])) * place
        return predicted
