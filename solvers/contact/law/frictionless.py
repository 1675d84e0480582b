"""Frictionless contact: z_n >= 0, g >= 0, z_n g = 0, and no tangential traction.

Source: Popp, Gitterle, Gee & Wall, Int. J. Numer. Meth. Engng 83 (2010), section 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.api import Array
from solvers.contact.blocks import block_diagonal
from solvers.contact.law.law import OPEN, SLIP, Point, Rows, Slopes, Span, Statuses, along


@dataclass(frozen=True)
class Frictionless:
    """Contact where z_n - c_n g > 0; there the gap is zero."""

    span: ClassVar[Span] = "normal"
    slips: ClassVar[bool] = False

    def status(self, at: Point) -> Statuses:
        return np.where(at.covered & (at.trial_pressure > 0.0), SLIP, OPEN).astype(np.int8)

    def residual(self, at: Point, status: Statuses, weight: float) -> Array:
        oblique = at.z - at.pressure[:, None] * at.normals
        return (at.stiffness * at.gap)[:, None] * at.normals + (weight * at.D)[:, None] * oblique

    def rows(self, at: Point, slopes: Slopes, status: Statuses, weight: float) -> Rows:
        dim = at.z.shape[1]
        closing = block_diagonal((at.stiffness[:, None] * at.normals)[:, :, None]) @ slopes.gap
        turning = slopes.normals.scaled_rows(np.repeat(weight * at.D * at.pressure, dim))
        by_z = (weight * at.D)[:, None, None] * along(at.normals)
        return Rows(self.residual(at, status, weight), by_z, closing - turning)
