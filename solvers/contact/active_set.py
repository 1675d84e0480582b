"""The active set: which multipliers are in contact, and whether they stick; a guard against cycles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import StepFailed
from solvers.contact.law.law import OPEN, Statuses

#: How often earlier active sets may recur in a step before it fails.
MAX_RECURRENCES = 6

#: What the complementarity parameter is multiplied by at every recurrence: with a large one, iterates
#: oscillate about the solution.
ON_RECURRENCE = 0.1


class ActiveSet:
    """Statuses of all multipliers as the laws choose them, iterate by iterate.

    Choosing anew in every iterate is the semi-smooth Newton reading of the complementarity conditions.
    Source: Alart & Curnier (1991); Hueber & Wohlmuth, Comput. Methods Appl. Mech. Engng 194 (2005).
    """

    def __init__(self, size: int):
        self.status: Statuses = np.full(size, OPEN, dtype=np.int8)
        self.changed = False  #: by the latest choice
        self.changes = 0  #: choices in this step that changed the set
        self.damping = 1.0  #: factor of the complementarity parameter in this step
        self._earlier: list[bytes] = []
        self._recurrences = 0

    @property
    def active(self) -> NDArray[np.bool_]:
        """In contact."""
        return self.status != OPEN

    def begin_step(self) -> None:
        """Clear the sets of the last step; the set itself is kept."""
        self.changed, self.changes, self.damping = False, 0, 1.0
        self._earlier, self._recurrences = [self.status.tobytes()], 0

    def choose(self, status: Statuses) -> None:
        """Take the statuses of this iterate. Raises StepFailed if the set cycles."""
        self.changed = bool(np.any(status != self.status))
        self.changes += self.changed
        if self.changed:
            chosen = status.tobytes()
            if chosen in self._earlier:
                self._recurrences += 1
                self.damping *= ON_RECURRENCE
            if self._recurrences > MAX_RECURRENCES:
                alternating = int(np.sum(status != self.status))
                raise StepFailed(
                    "contact", f"the active set cycles: {alternating} nodes change their status again and again"
                )
            self._earlier.append(chosen)
        self.status = status.copy()
