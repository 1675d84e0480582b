"""Coverage: the share of a slave node's area that faces a master, and the limit for a constraint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.mortar import KEEP_AFTER

#: Smallest covered share of a slave node's area for a constraint: for a new one, and for one that this step has had.
LEAST_COVERED, LEAST_KEPT = 0.02, 0.01


class Coverage:
    """Chooses the multipliers with enough coverage in every evaluation of a step.

    After KEEP_AFTER evaluations, a multiplier that had a constraint keeps it above the lower limit, so that the set of
    constraints does not alternate. Facet pairs are kept in the same way.
    """

    def __init__(self, areas: Array):
        self._areas = np.maximum(areas, np.finfo(float).tiny)
        self._constrained = np.zeros(len(self._areas), dtype=bool)
        self._evaluations = 0

    def begin_step(self) -> None:
        self._constrained = np.zeros(len(self._areas), dtype=bool)
        self._evaluations = 0

    def enough(self, D: Array, least: float = LEAST_COVERED) -> NDArray[np.bool_]:
        """Mask of the multipliers whose covered areas D [m^(dim-1)] exceed the share `least`, shape (C,)."""
        return D > least * self._areas

    def choose(self, D: Array) -> NDArray[np.bool_]:
        """Mask of the multipliers that may have a constraint in an iterate, shape (C,)."""
        found = self.enough(D) | (self._constrained & self.enough(D, LEAST_KEPT))
        self._evaluations += 1
        if self._evaluations >= KEEP_AFTER:
            self._constrained |= found
        return found
