"""The convergence of an iteration from its residuals: kind, rate and a curve in text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Literal

Kind = Literal["none", "not finite", "diverges", "stagnates", "oscillates", "converges"]

WINDOW = 6  #: last iterations that decide
GROWTH_OF_DIVERGENCE = 10.0  #: of the residual over its least value that is called divergence
STILL = 0.9  #: rate from which an iteration stagnates
BAR_WIDTH = 40  #: characters of the largest bar


@dataclass(frozen=True)
class Convergence:
    """How an iteration converges, or fails to."""

    kind: Kind
    rate: float = math.nan  #: median of r_(k+1) / r_k over the last iterations

    def remaining(self, residual: float, goal: float) -> int | None:
        """Iterations until the goal at this rate, if it converges: log(goal / residual) / log(rate)."""
        if self.kind != "converges" or not 0.0 < goal < residual:
            return None
        return math.ceil(math.log(goal / residual) / math.log(self.rate))


def convergence_of(residuals: Sequence[float]) -> Convergence:
    """The kind and rate of convergence of the last iterations."""
    if len(residuals) < 2:
        return Convergence("none")
    if not all(math.isfinite(r) for r in residuals):
        return Convergence("not finite")
    last = residuals[-WINDOW:]
    ratios = [after / before for before, after in pairwise(last) if before > 0]
    rate = median(ratios) if ratios else 0.0
    turns = sum((a > 1) != (b > 1) for a, b in pairwise(ratios))
    if len(ratios) > 2 and turns >= len(ratios) - 2 and max(ratios) > 1 and residuals[-1] < max(residuals):
        return Convergence("oscillates", rate)
    if residuals[-1] > GROWTH_OF_DIVERGENCE * min(residuals):
        return Convergence("diverges", rate)
    if len(ratios) < 2 and rate > STILL:  # one iteration does not show that the next ones do not help
        return Convergence("none")
    return Convergence("stagnates" if rate > STILL else "converges", rate)


def curve(residuals: Sequence[float]) -> list[str]:
    """A line for each iteration: number, residual, and a bar that is longer by a step for each power of ten."""
    finite = [r for r in residuals if math.isfinite(r) and r > 0]
    if not finite:
        return [f"  {number:3d}  {r:9.2e}" for number, r in enumerate(residuals)]
    low, high = math.log10(min(finite)), math.log10(max(finite))
    span = max(high - low, 1.0)
    lines = []
    for number, r in enumerate(residuals):
        share = (math.log10(r) - low) / span if math.isfinite(r) and r > 0 else 0.0
        lines.append(f"  {number:3d}  {r:9.2e}  {'#' * round(1 + share * (BAR_WIDTH - 1))}")
    return lines
