"""Friction of a slave surface whose pairs have several laws: the bound is the mean of theirs by covered area."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.api import Array
from solvers.contact.law.friction import FrictionBound, friction_residual, friction_rows, friction_status
from solvers.contact.law.law import Point, Span


@dataclass(frozen=True)
class ByPair:
    """s_j = sum_k a_jk s_k, where a_jk is the share of pair k in int N_j over the covered area.

    Shares are those of the beginning of the step, so that the linearisation is complete. They are not those of the dual
    functions, which may be negative. A node that only one master covers has the friction of its pair.
    """

    bounds: tuple[FrictionBound | None, ...]  #: of each pair of the interface; None: no friction
    span: ClassVar[Span] = "surface"
    slips: ClassVar[bool] = True

    status = friction_status
    residual = friction_residual
    rows = friction_rows

    def radius(self, at: Point) -> Array:
        parts = [share * bound.radius(at) for share, bound in self._parts(at)]
        return np.sum(parts, axis=0) if parts else np.zeros(len(at.z))

    def radius_slopes(self, at: Point) -> tuple[Array, Array, Array]:
        by_z, by_normal, by_gap = np.zeros_like(at.z), np.zeros_like(at.z), np.zeros(len(at.z))
        for share, bound in self._parts(at):
            slopes = bound.radius_slopes(at)
            by_z += share[:, None] * slopes[0]
            by_normal += share[:, None] * slopes[1]
            by_gap += share * slopes[2]
        return by_z, by_normal, by_gap

    def _parts(self, at: Point) -> list[tuple[Array, FrictionBound]]:
        shares = zip(at.shares.T, self.bounds, strict=True)
        return [(share, bound) for share, bound in shares if bound is not None and share.any()]
