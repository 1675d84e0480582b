"""The active set: the status of every multiplier (open, slip, stick), with damping and detection of cycles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, StepFailed
from solvers.contact.law.law import OPEN, Statuses

#: Largest count of recurrences of earlier active sets in a step.
MAX_RECURRENCES = 6

#: Factor of the complementarity parameter at every recurrence: with a large parameter, iterates oscillate.
ON_RECURRENCE = 0.1


class ActiveSet:
    """Statuses of all multipliers, which the laws choose in every iterate.

    This choice in every iterate is a semi-smooth Newton method for the complementarity conditions.
    Source: Alart & Curnier (1991); Hueber & Wohlmuth, Comput. Methods Appl. Mech. Engng 194 (2005).
    """

    def __init__(self, size: int):
        self.status: Statuses = np.full(size, OPEN, dtype=np.int8)
        self.changed = False  #: whether the latest choice changed the set
        self.changes = 0  #: count of choices in this step that changed the set
        self.damping = 1.0  #: factor of the complementarity parameter in this step
        self.tried = np.zeros(size, dtype=bool)  #: mask of the multipliers that were in contact in this solve
        self._earlier: list[bytes] = []
        self._recurrences = 0

    @property
    def active(self) -> NDArray[np.bool_]:
        """Mask of the multipliers in contact."""
        return self.status != OPEN

    def begin_step(self) -> None:
        """Discard the earlier sets of the last step; the present set is kept."""
        self.changed, self.changes = False, 0
        self.begin_solve()

    def begin_solve(self) -> None:
        """Discard the earlier sets, which other loads may have chosen."""
        self.damping, self._earlier, self._recurrences = 1.0, [self.status.tobytes()], 0
        self.tried = self.active

    def choose(self, status: Statuses, x: Array) -> None:
        """Set the statuses of this iterate. Raises StepFailed if the set cycles, with the place of the first node.

        x: positions [m] of the nodes of all multipliers, shape (C, dim).
        """
        self.changed = bool(np.any(status != self.status))
        self.changes += self.changed
        if self.changed:
            chosen = status.tobytes()
            if chosen in self._earlier:
                self._recurrences += 1
                self.damping *= ON_RECURRENCE
            if self._recurrences > MAX_RECURRENCES:
                alternating = np.flatnonzero(status != self.status)
                change = "node changes its" if len(alternating) == 1 else "nodes change their"
                raise StepFailed(
                    "contact",
                    f"the active set cycles: {len(alternating)} {change} status again and again; "
                    "take a smaller time step",
                    where=tuple(float(c) for c in x[alternating[0]]),
                )
            self._earlier.append(chosen)
        self.status = status.copy()
        self.tried = self.tried | self.active
