"""Tresca's friction: the traction along the surface is at most a given one, wherever the surfaces touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.api import Array
from solvers.contact.law.friction import friction_residual, friction_rows, friction_status
from solvers.contact.law.law import Point, Rows, Slopes, Span, Statuses


@dataclass(frozen=True)
class Tresca:
    """|z_t| <= bound."""

    bound: float  #: largest traction along the surface [Pa]
    span: ClassVar[Span] = "surface"
    slips: ClassVar[bool] = True

    def status(self, at: Point) -> Statuses:
        return friction_status(at, self._radius(at))

    def residual(self, at: Point, status: Statuses, weight: float) -> Array:
        return friction_residual(at, status, weight, self._radius(at))

    def rows(self, at: Point, slopes: Slopes, status: Statuses, weight: float) -> Rows:
        zero = np.zeros_like(at.z)
        return friction_rows(
            at, slopes, status, weight, self._radius(at), by_z=zero, by_normal=zero, by_gap=np.zeros_like(at.D)
        )

    def _radius(self, at: Point) -> Array:
        return np.where(at.slip_known, self.bound, 0.0)
