"""Where a surface will be: the parabola through its last three places, or as much of it as is known.

d(t) = sum_i L_i(t) d_i, L_i the Lagrange polynomials on the times t_i, whatever the lengths of the steps were.
"""

from __future__ import annotations

import numpy as np

from solvers.api import Array, State


class Predictor:
    """The last places of a surface, newest first, three at most."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._places: list[Array] = []

    def add(self, t: float, d: Array) -> None:
        """Displacements [m] at time t [s], later than all before."""
        self._times, self._places = [t, *self._times][:3], [d.copy(), *self._places][:3]

    def at(self, t: float) -> Array:
        """Displacements [m] expected at time t [s]."""
        predicted = np.zeros_like(self._places[0])
        for i, (time, place) in enumerate(zip(self._times, self._places, strict=True)):
            others = [other for j, other in enumerate(self._times) if j != i]
            predicted += float(np.prod([(t - other) / (time - other) for other in others])) * place
        return predicted

    def save(self) -> State:
        return {"times": np.array(self._times), "places": np.array(self._places)}

    def restore(self, state: State) -> None:
        self._times, self._places = state["times"].tolist(), list(state["places"])
