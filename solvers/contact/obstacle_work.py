"""The work of obstacles with a motion of their own: minus the contact force on them times their displacement."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, State


class ObstacleWork:
    """Work on the bodies, summed over steps, by the mean of the forces at both ends of each."""

    def __init__(self, nodes: NDArray[np.int64], dim: int):
        """nodes: those of the obstacles, which may begin to move when a run is resumed."""
        self._nodes = nodes
        self._force = np.zeros((len(nodes), dim))  # on the obstacles at the end of the last step [N]
        self.total = 0.0  #: [J]
        self.doubt = 0.0  #: sum over steps of half the difference between the works of both forces [J]

    def end_step(self, force: Array, moved: Array) -> None:
        """Add an accepted step; force [N] on all nodes at its end, moved: their displacement [m], (N, dim)."""
        if len(self._nodes):
            before, self._force = self._force, force[self._nodes]
            at_start, at_end = (float((some * moved[self._nodes]).sum()) for some in (before, self._force))
            self.total -= 0.5 * (at_start + at_end)
            self.doubt += 0.5 * abs(at_end - at_start)

    def save(self) -> State:
        return {"total": self.total, "doubt": self.doubt, "force": self._force.copy()}

    def restore(self, state: State) -> None:
        self.total, self.doubt, self._force = state["total"], state["doubt"], state["force"].copy()
