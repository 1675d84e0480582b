"""The active set: the status of every multiplier (open, slip, stick), with detection of cycles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.contact.law.law import OPEN, SLIP, STICK, Statuses

#: Quasi-static problems with much friction may have no solution: a node slips if it sticks and sticks if it slips.
#: Source: Klarbring, Ingenieur-Archiv 60 (1990) 529-541.
WEDGED = "; it sticks and slips in turn: with this much friction an edge may wedge, and no forces balance; take less"


class ActiveSet:
    """Statuses of all multipliers, which the laws choose in every iterate.

    This choice in every iterate is a semi-smooth Newton method for the complementarity conditions. Its iterates may
    alternate between a few sets; a line search then leads out of the cycle.
    Source: Alart & Curnier (1991); Hueber & Wohlmuth, Comput. Methods Appl. Mech. Engng 194 (2005).
    """

    def __init__(self, size: int):
        self.status: Statuses = np.full(size, OPEN, dtype=np.int8)
        self.first = True  #: whether the next choice is the first one of a solve
        self.changed = False  #: whether the latest choice changed the set
        self.changes = 0  #: count of choices in this step that changed the set
        self.alternating = 0  #: nodes whose status changed when an earlier set came back in this step; 0: none did
        self.returned = np.zeros(size, dtype=bool)  #: mask of all nodes whose status changed so in this solve
        self.wedged = False  #: whether one of them was stuck and slipped in turn
        self.tried = np.zeros(size, dtype=bool)  #: mask of the multipliers that were in contact in this solve
        self.stuck = np.zeros(size, dtype=bool)  #: mask of those whose slip may reverse
        self._earlier: set[bytes] = set()
        self._reversals: set[bytes] = set()
        self._alternates = False  # slips, in this solve

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
        self.first = True
        self.alternating, self.wedged, self._earlier = 0, False, {self.status.tobytes()}
        self.returned = np.zeros_like(self.returned)
        self._reversals, self._alternates = set(), False
        self.tried, self.stuck = self.active, np.zeros_like(self.stuck)

    def choose(self, status: Statuses) -> None:
        """Set the statuses of this iterate."""
        different = int(np.sum(status != self.status))
        self.changed = different > 0
        self.changes += self.changed
        if self.changed:
            chosen = status.tobytes()
            if chosen in self._earlier:
                self.alternating = different
                self.returned = self.returned | (status != self.status)
                self.wedged |= bool((np.minimum(status, self.status)[status != self.status] == SLIP).any())
            self._earlier.add(chosen)
        self.first = False
        self.status = status.copy()
        self.tried = self.tried | self.active
        self.stuck = self.stuck | (status == STICK) & (not self._alternates)

    def begin_increment(self, reversing: NDArray[np.bool_]) -> None:
        """Note that an increment follows the latest choice; reversing: mask of the slips against the present traction.

        A node that has stuck may slip to and fro in all following iterates, with one status, where sticking would be
        right. Once the same nodes reverse in the same set again, each node sticks whenever its slip reverses. To begin
        like that would take an iterate for each node of a belt that comes to slide.
        """
        if reversing.any():
            chosen = np.where(reversing, -self.status, self.status).tobytes()
            if chosen in self._reversals:
                self._alternates, self.stuck = True, np.zeros_like(self.stuck)
            self._reversals.add(chosen)

    def cycle(self) -> str:
        """What cycles, for messages; empty if no earlier set of this step has come back."""
        if self.alternating == 0:
            return ""
        nodes = "1 node changes its" if self.alternating == 1 else f"{self.alternating} nodes change their"
        cycles = f"the active set cycles: {nodes} status again and again"
        return cycles + WEDGED if self.wedged else cycles
