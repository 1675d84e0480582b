"""Tresca friction: the tangential traction is at most a given bound where surfaces touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.api import Array
from solvers.contact.law.friction import friction_residual, friction_rows, friction_status
from solvers.contact.law.law import Point, Span


@dataclass(frozen=True)
class Tresca:
    """|z_t| <= bound."""

    bound: float  #: largest tangential traction [Pa]
    span: ClassVar[Span] = "surface"
    slips: ClassVar[bool] = True

    status = friction_status
    residual = friction_residual
    rows = friction_rows

    def radius(self, at: Point) -> Array:
        return np.where(at.slip_defined, self.bound, 0.0)

    def radius_slopes(self, at: Point) -> tuple[Array, Array, Array]:
        return np.zeros_like(at.z), np.zeros_like(at.z), np.zeros_like(at.D)
