"""Tresca friction: the tangential traction is at most a given bound where surfaces touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.api import Array
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.friction import friction_residual, friction_rows, friction_status
from solvers.contact.law.law import Point, Span

#: Ratio of traction to pressure up to which the bound counts. Without it the bound would jump to zero where a surface
#: opens, and a node may have no solution: the friction of a closed gap opens it, and without friction it closes.
STEEP = Coulomb(1e3)


@dataclass(frozen=True)
class Tresca:
    """|z_t| <= bound, and at most STEEP times the pressure: no traction without any pressure."""

    bound: float  #: largest tangential traction [Pa]
    span: ClassVar[Span] = "surface"
    slips: ClassVar[bool] = True

    status = friction_status
    residual = friction_residual
    rows = friction_rows

    def radius(self, at: Point) -> Array:
        return np.where(at.slip_defined, np.minimum(self.bound, STEEP.radius(at)), 0.0)

    def radius_slopes(self, at: Point) -> tuple[Array, Array, Array]:
        steep = at.slip_defined & (STEEP.radius(at) < self.bound)
        by_z, by_normal, by_gap = STEEP.radius_slopes(at)
        return steep[:, None] * by_z, steep[:, None] * by_normal, steep * by_gap
