"""Impacts of coupled bodies: the flow takes such a step, and the next one, by backward Euler.

A plastic impact changes the velocity of the fluid in one step. BDF2 counts half of the change too much there and gives
it back in the next step, as a pull on the body: it left the wall with a quarter of its velocity.
"""

from __future__ import annotations

from coupling.ports import Solid, Start
from solvers.api import FailureKind, StepFailed


class Impact(StepFailed):
    """Contact has closed in a step whose formula counts velocities from before: it has to start anew there."""


class Impacts:
    """Finds the steps in which the first contact closes."""

    def __init__(self, solid: Solid, start: Start | None):
        """start: None: the formulas of the flow count no earlier velocities, or nothing has inertia."""
        self._solid, self._start = solid, start
        self._apart = False  #: whether nothing was in contact at the start of the step

    @property
    def possible(self) -> bool:
        """Whether the next step may have to be taken again."""
        waits = self._start is not None and self._solid.touching() is not None and self._start.flow.counts_earlier
        return waits and not self._solid.in_contact()

    def begin_step(self) -> None:
        self._apart = self.possible

    def require_none(self) -> None:
        """Raise Impact if the first contact has closed in this step."""
        if self._apart and self._solid.in_contact():
            raise Impact(self._solid.name, FailureKind.NOT_HELD, "contact closed in this step")

    def start_anew(self, dt: float) -> None:
        """Prepare both parts for the step of length dt [s], at whose start they are again."""
        assert self._start is not None
        self._start.flow.forget_earlier()
        self._start.solid.strike(dt)
