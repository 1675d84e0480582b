"""The work of friction: tangential force times slip, summed over steps."""

from __future__ import annotations

import numpy as np

from solvers.api import Array, State


class FrictionWork:
    """Energy that friction has dissipated, and slip and tangential forces at the end of the last step."""

    def __init__(self, shape: tuple[int, int]):
        self.total = 0.0  #: [J]
        self.slip = np.zeros(shape)  #: along the surface [m]
        self._force = np.zeros(shape)  # [N]

    def of_step(self, weight: float, force: Array, slip: Array) -> float:
        """Work [J] of a step. weight: of the forces at its end; force: tangential [N], slip [m]: (C, dim)."""
        return float(np.sum((weight * force + (1.0 - weight) * self._force) * slip))

    def end_step(self, weight: float, force: Array, slip: Array) -> None:
        """Add the work of an accepted step."""
        self.total += self.of_step(weight, force, slip)
        self.slip, self._force = slip.copy(), force.copy()

    def save(self) -> State:
        return {"total": self.total, "slip": self.slip.copy(), "force": self._force.copy()}

    def restore(self, state: State) -> None:
        self.total, self.slip, self._force = state["total"], state["slip"].copy(), state["force"].copy()
