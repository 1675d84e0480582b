"""The work of an interference that changes: the normal force of each pair times the change of its interference."""

from __future__ import annotations

import numpy as np

from solvers.api import Array, State


class InterferenceWork:
    """Work on the bodies, summed over steps, by the mean of the forces at both ends of each."""

    def __init__(self, pairs: int):
        self._length, self._force = np.zeros(pairs), np.zeros(pairs)  # [m] and [N] at the end of the last step
        self.total = 0.0  #: [J]
        self.doubt = 0.0  #: sum over steps of half the difference between the works of both forces [J]

    def start(self, length: Array) -> None:
        """Begin with an interference [m] of each pair: what it takes to make it is energy of the start."""
        self._length = length

    def end_step(self, force: Array, length: Array) -> None:
        """Add an accepted step; normal force [N] and interference [m] of each pair at its end."""
        change = length - self._length
        self.total += 0.5 * float((self._force + force) @ change)
        self.doubt += 0.5 * abs(float((force - self._force) @ change))
        self._length, self._force = length, force

    def save(self) -> State:
        return {"total": self.total, "doubt": self.doubt, "length": self._length.copy(), "force": self._force.copy()}

    def restore(self, state: State) -> None:
        self.total, self.doubt = state["total"], state["doubt"]
        self._length, self._force = state["length"].copy(), state["force"].copy()
