"""Work in contact, summed over steps: of friction, of obstacles that move, of an interference that changes."""

from __future__ import annotations

import numpy as np

from solvers.api import Array, State
from solvers.contact.law.law import along


def along_surface(normals: Array, force: Array, slip: Array) -> tuple[Array, Array]:
    """The parts of forces [N] and slips [m] along the surface, all of shape (C, dim)."""
    tangent = along(normals)
    return np.einsum("nij,nj->ni", tangent, force), np.einsum("nij,nj->ni", tangent, slip)


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


class GivenWork:
    """Work on the bodies of a motion that is given, by the mean of the forces at both ends of each step."""

    def __init__(self, shape: tuple[int, ...]):
        self._force = np.zeros(shape)  # along the motion, at the end of the last step [N]
        self.total = 0.0  #: [J]
        self.doubt = 0.0  #: sum over steps of half the difference between the works of both forces [J]

    def end_step(self, force: Array, moved: Array) -> None:
        """Add an accepted step; force [N] at its end and motion in it [m]."""
        at_start, at_end = (float((some * moved).sum()) for some in (self._force, force))
        self.total += 0.5 * (at_start + at_end)
        self.doubt += 0.5 * abs(at_end - at_start)
        self._force = force

    def save(self) -> State:
        return {"total": self.total, "doubt": self.doubt, "force": self._force.copy()}

    def restore(self, state: State) -> None:
        self.total, self.doubt, self._force = state["total"], state["doubt"], state["force"].copy()
