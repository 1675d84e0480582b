"""Coulomb friction: the tangential traction is at most mu times the pressure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.api import Array
from solvers.contact.law.friction import friction_residual, friction_rows, friction_status
from solvers.contact.law.law import Point, Span


@dataclass(frozen=True)
class Coulomb:
    """|z_t| <= mu p with the trial pressure p = z_n - c_n g, which is positive in contact and z_n in the solution."""

    mu: float  #: coefficient of friction
    span: ClassVar[Span] = "surface"
    slips: ClassVar[bool] = True

    status = friction_status
    residual = friction_residual
    rows = friction_rows

    def radius(self, at: Point) -> Array:
        return self.mu * np.where(at.slip_defined, np.maximum(0.0, at.trial_pressure), 0.0)

    def radius_slopes(self, at: Point) -> tuple[Array, Array, Array]:
        mu = self.mu * (at.slip_defined & (at.trial_pressure > 0.0))
        by_gap = -mu * np.divide(at.c_n, at.D, out=np.zeros_like(at.D), where=at.D > 0.0)
        return mu[:, None] * at.normals, mu[:, None] * at.z, by_gap
