"""The primal-dual active set: which slave nodes are in contact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, StepFailed

#: How often a step may come back to an active set it has left before it is given up.
MAX_RETURNS = 6

#: What c_n is multiplied by at every return: with a large one, iterates step over the solution to and fro.
ON_RETURN = 0.1


class ActiveSet:
    """Active where z_n - c_n s g > 0 with the pressure z_n, the mean gap g and the nodal stiffness per area s.

    This is the semi-smooth Newton reading of z_n >= 0, g >= 0, z_n g = 0; the solution does not depend on c_n > 0.
    Source: Alart & Curnier (1991); Hueber & Wohlmuth, Comput. Methods Appl. Mech. Engng 194 (2005).
    """

    def __init__(self, size: int, c_n: float = 1.0):
        self.c_n = c_n
        self.active = np.zeros(size, dtype=bool)
        self.changed = False  #: by the latest update
        self.changes = 0  #: updates in this step that changed the set
        self._c_n = c_n  # of this step
        self._seen: list[bytes] = []
        self._returns = 0

    def begin_step(self) -> None:
        """Forget what was seen in the last step; the set itself stays."""
        self.changed, self.changes = False, 0
        self._c_n = self.c_n
        self._seen, self._returns = [self.active.tobytes()], 0

    def clear(self) -> None:
        """No node is near the other side."""
        self._take(np.zeros_like(self.active))

    def update(self, pressure: Array, gap: Array, stiffness: Array, covered: NDArray[np.bool_]) -> None:
        """Choose the active nodes among the covered ones. Raises StepFailed if the set goes in circles."""
        self._take(covered & (pressure - self._c_n * stiffness * gap > 0.0))

    def _take(self, chosen: NDArray[np.bool_]) -> None:
        self.changed = bool(np.any(chosen != self.active))
        self.changes += self.changed
        if self.changed:
            known = chosen.tobytes()
            if known in self._seen:
                self._returns += 1
                self._c_n *= ON_RETURN
            if self._returns > MAX_RETURNS:
                flickering = int(np.sum(chosen != self.active))
                raise StepFailed("contact", f"the active set goes in circles: {flickering} nodes cannot decide")
            self._seen.append(known)
        self.active[:] = chosen
