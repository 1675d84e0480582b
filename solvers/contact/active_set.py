"""The active set: the status of every multiplier (open, slip, stick), with detection of cycles.

Multipliers of bodies that touch are one component, see `take_components`. Each component is as if it were alone: its
set may come back to an earlier one while that of another one still changes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Indices
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
        self.settled = True  #: whether the latest choice changed only what has come back to an earlier set
        self.alternating = 0  #: nodes whose status changed when an earlier set came back in this step; 0: none did
        self.returned = np.zeros(size, dtype=bool)  #: mask of all nodes whose status changed so in this solve
        self.wedged = False  #: whether one of them was stuck and slipped in turn
        self.tried = np.zeros(size, dtype=bool)  #: mask of the multipliers that were in contact in this solve
        self.stuck = np.zeros(size, dtype=bool)  #: mask of those whose slip may reverse
        self._component: Indices = np.zeros(size, dtype=np.int64)
        self._earlier: list[Statuses] = []
        self._reversals: list[Statuses] = []
        self._alternates = np.zeros(size, dtype=bool)  # mask of the slips that do, in this solve

    @property
    def active(self) -> NDArray[np.bool_]:
        """Mask of the multipliers in contact."""
        return self.status != OPEN

    def begin_step(self) -> None:
        """Discard the earlier sets of the last step; the present set is kept."""
        self.changed, self.changes, self.settled = False, 0, True
        self.begin_solve()

    def begin_solve(self) -> None:
        """Discard the earlier sets, which other loads may have chosen."""
        self.first = True
        self.alternating, self.wedged, self._earlier = 0, False, [self.status]
        self.returned = np.zeros_like(self.returned)
        self._reversals, self._alternates = [], np.zeros_like(self._alternates)
        self.tried, self.stuck = self.active, np.zeros_like(self.stuck)

    def take_components(self, component: Indices) -> None:
        """Set the component of each multiplier, any number that those of bodies that touch share, shape (C,)."""
        self._component = component

    def choose(self, status: Statuses) -> None:
        """Set the statuses of this iterate."""
        different = status != self.status
        self.changed = bool(different.any())
        self.changes += self.changed
        if self.changed:
            back = different & self._recurs(status, self._earlier)
            if back.any():
                self.alternating = int(back.sum())
                self.returned = self.returned | back
                self.wedged |= bool((np.minimum(status, self.status)[back] == SLIP).any())
            self._earlier.append(status.copy())
        self.settled = not (different & ~self._in_components(self.returned)).any()
        self.first = False
        self.status = status.copy()
        self.tried = self.tried | self.active
        self.stuck = self.stuck | (status == STICK) & ~self._alternates

    def begin_increment(self, reversing: NDArray[np.bool_]) -> None:
        """Note that an increment follows the latest choice; reversing: mask of the slips against the present traction.

        A node that has stuck may slip to and fro in all following iterates, with one status, where sticking would be
        right. Once the same nodes reverse in the same set again, each node sticks whenever its slip reverses. To begin
        like that would take an iterate for each node of a belt that comes to slide.
        """
        if reversing.any():
            chosen = np.where(reversing, -self.status, self.status)
            again = self._in_components(reversing) & self._recurs(chosen, self._reversals)
            self._alternates, self.stuck = self._alternates | again, self.stuck & ~again
            self._reversals.append(chosen)

    def _recurs(self, status: Statuses, earlier: Sequence[Statuses]) -> NDArray[np.bool_]:
        """Mask of the multipliers whose whole component has these statuses in one of the earlier sets."""
        found = np.zeros(len(status), dtype=bool)
        for other in earlier:
            found |= ~self._in_components(status != other)
        return found

    def _in_components(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Mask of the multipliers in a component with some of the given ones."""
        return np.isin(self._component, self._component[mask])

    def cycle(self) -> str:
        """What cycles, for messages; empty if no earlier set of this step has come back."""
        if self.alternating == 0:
            return ""
        nodes = "1 node changes its" if self.alternating == 1 else f"{self.alternating} nodes change their"
        cycles = f"the active set cycles: {nodes} status again and again"
        return cycles + WEDGED if self.wedged else cycles
