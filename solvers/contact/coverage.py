"""Which multipliers a master covers enough for a constraint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.mortar import KEEP_AFTER

#: Share of a slave node's area that must see a master, and the share with which a node that did in this step still may.
LEAST_COVERED, LEAST_KEPT = 0.02, 0.01


class Coverage:
    """Decides on coverage in every evaluation of a step.

    After KEEP_AFTER evaluations a multiplier that had a constraint keeps it as long as the lower limit is met, so that
    the set of constraints cannot alternate. Facet pairs are kept in the same way.
    """

    def __init__(self, areas: Array):
        self._areas = np.maximum(areas, np.finfo(float).tiny)
        self._constrained = np.zeros(len(self._areas), dtype=bool)
        self._evaluations = 0

    def begin_step(self) -> None:
        self._constrained = np.zeros(len(self._areas), dtype=bool)
        self._evaluations = 0

    def enough(self, D: Array, least: float = LEAST_COVERED) -> NDArray[np.bool_]:
        """Whether the covered areas D [m^(dim-1)] are more than slivers, shape (C,)."""
        return D > least * self._areas

    def choose(self, D: Array) -> NDArray[np.bool_]:
        """Those of an iterate that can have a constraint, shape (C,)."""
        found = self.enough(D) | (self._constrained & self.enough(D, LEAST_KEPT))
        self._evaluations += 1
        if self._evaluations >= KEEP_AFTER:
            self._constrained |= found
        return found
