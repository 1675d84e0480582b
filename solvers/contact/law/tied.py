"""Tying: no relative motion, for any traction.

Source: Puso & Laursen, Comput. Methods Appl. Mech. Engng 193 (2004), mesh tying with mortar elements.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.api import Array
from solvers.contact.law.law import OPEN, STICK, Point, Rows, Slopes, Span, Statuses


@dataclass(frozen=True)
class Tied:
    """Zero slip since the reference configuration, in all directions."""

    span: ClassVar[Span] = "space"
    slips: ClassVar[bool] = False

    def status(self, at: Point) -> Statuses:
        return np.where(at.covered, STICK, OPEN).astype(np.int8)

    def residual(self, at: Point, status: Statuses, weight: float) -> Array:
        return (at.stiffness * at.D)[:, None] * at.slip

    def rows(self, at: Point, slopes: Slopes, status: Statuses, weight: float) -> Rows:
        m, dim = at.z.shape
        by_u = slopes.slip.scaled_rows(np.repeat(at.stiffness * at.D, dim))
        return Rows(self.residual(at, status, weight), np.zeros((m, dim, dim)), by_u)
