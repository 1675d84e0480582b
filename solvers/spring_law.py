"""The force of a spring with a damper between two points, and its derivatives.

With the vector d from the second point to the first one, its length L and e = d / L, the force on the first point is

    F = -(k (L - L_0) + c e . d') e,    and   F = -k d - c d'   without a length, L_0 = 0,

which holds the points together in all directions. The second point has -F, so momentum is kept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solvers.api import Array

#: Position [m] and velocity [m/s] of a point at present, each of shape (3,) (collective).
PointMotion = Callable[[], tuple[Array, Array]]


@dataclass(frozen=True)
class SpringLaw:
    """What the force depends on besides the points."""

    stiffness: float  #: k [N/m]; in 2D per depth
    damping: float  #: c [N s/m]; in 2D per depth
    length: float  #: L_0 without force [m]

    def force(self, d: Array, rate: Array) -> tuple[Array, Array, Array]:
        """(F [N], its derivative by d [N/m], by d' [N s/m]) of shapes (3,), (3, 3), (3, 3)."""
        k, c = self.stiffness, self.damping
        length = float(np.linalg.norm(d))
        if self.length == 0.0 or length == 0.0:
            return -k * d - c * rate, -k * np.eye(3), -c * np.eye(3)
        e = d / length
        turned = (np.eye(3) - np.outer(e, e)) / length
        tension = k * (length - self.length) + c * e @ rate
        by_d = -np.outer(e, k * e + c * rate @ turned) - tension * turned
        return -tension * e, by_d, -c * np.outer(e, e)

    def energy(self, d: Array) -> float:
        """k (L - L_0)^2 / 2 [J]."""
        return 0.5 * self.stiffness * (float(np.linalg.norm(d)) - self.length) ** 2
