"""Gaps that are the rounding of positions, and so are none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array

#: Gap that is the rounding of positions, relative to the extent of all surfaces, and to their distance from the origin.
GAP_OF_EXTENT, GAP_OF_DISTANCE = 1e-12, 1e-15

#: The same of nodes that no iterate of this solve has pressed yet: rounding of meshes and their translations. They are
#: tried. As those that would pull are open in the next iterate, the result does not depend on it.
GAP_OF_TRIED = 1e-10


@dataclass(frozen=True)
class NoGap:
    """Gaps that count as closed [m]."""

    pressed: float  #: of nodes that some iterate has pressed
    others: float

    @classmethod
    def among(cls, points: Array) -> NoGap:
        """Of surfaces with these nodes at the start, shape (N, dim)."""
        extent, far = float(np.ptp(points, axis=0).max()), float(np.abs(points).max())
        return cls(max(GAP_OF_EXTENT * extent, GAP_OF_DISTANCE * far), GAP_OF_TRIED * max(extent, far))

    def at(self, pressed: NDArray[np.bool_]) -> Array:
        """By multiplier; pressed: mask of those that some iterate has pressed."""
        return np.where(pressed, self.pressed, self.others)
