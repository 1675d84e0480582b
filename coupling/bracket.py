"""Coupling iterates between two sets of contact: the segment on which the residual changes its direction.

An opening film pulls with 1 / height^2 and more, so the solid closes it under the force of one iterate and opens it
under that of the next. With ends a, b and r(a) . (b - a) > 0 > r(b) . (b - a) the segment is halved until the solid's
contact is the same at both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array


@dataclass(frozen=True)
class CouplingIterate:
    """One evaluation of the coupling."""

    d: Array  #: displacement of the interface that the flow took [m]
    found: Array  #: that of the solid under the force of this flow [m]
    touching: NDArray[np.bool_] | None  #: nodes that the solid has in contact; None: it has no contact

    @property
    def residual(self) -> Array:
        return self.found - self.d

    def same_contact(self, other: CouplingIterate) -> bool:
        """Or no contact at all."""
        if self.touching is None or other.touching is None:
            return True
        return np.array_equal(self.touching, other.touching)


def brackets(one: CouplingIterate, other: CouplingIterate) -> bool:
    """The solid's contact is not the same, and the residuals point at each other."""
    along = other.d - one.d
    return not one.same_contact(other) and (one.residual * along).sum() > 0.0 > (other.residual * along).sum()


def halved(
    one: CouplingIterate, other: CouplingIterate, middle: CouplingIterate
) -> tuple[CouplingIterate, CouplingIterate]:
    """The half on which the residual changes its direction, newest last."""
    along = other.d - one.d
    return (other, middle) if (middle.residual * along).sum() > 0.0 else (one, middle)
