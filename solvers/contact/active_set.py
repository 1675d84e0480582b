"""The active set: which multipliers are in contact, and whether they stick; a guard against cycles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import StepFailed
from solvers.contact.law.law import OPEN, Statuses

#: How often a step may come back to an active set it has left before it is given up.
MAX_RETURNS = 6

#: What the complementarity parameter is multiplied by at every return: with a large one, iterates step over the
#: solution to and fro.
ON_RETURN = 0.1


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
        self._seen: list[bytes] = []
        self._returns = 0

    @property
    def active(self) -> NDArray[np.bool_]:
        """In contact."""
        return self.status != OPEN

    def begin_step(self) -> None:
        """Clear the sets seen in the last step; the set itself is kept."""
        self.changed, self.changes, self.damping = False, 0, 1.0
        self._seen, self._returns = [self.status.tobytes()], 0

    def choose(self, status: Statuses) -> None:
        """Take the statuses of this iterate. Raises StepFailed if the set cycles."""
        self.changed = bool(np.any(status != self.status))
        self.changes += self.changed
        if self.changed:
            known = status.tobytes()
            if known in self._seen:
                self._returns += 1
                self.damping *= ON_RETURN
            if self._returns > MAX_RETURNS:
                flickering = int(np.sum(status != self.status))
                raise StepFailed(
                    "contact", f"the active set cycles: {flickering} nodes change their status again and again"
                )
            self._seen.append(known)
        self.status = status.copy()
