"""Steps that are too long for the time rule of the flow after a shorter one are divided into parts that grow."""

from __future__ import annotations

import math
from collections.abc import Callable

from solvers.api import StepInfo


def lengths(dt: float, longest: float) -> tuple[float, ...]:
    """Lengths [s] of the parts of a step of length dt: h, h, 2 h, 4 h, ... with the largest h = dt / 2^m <= longest."""
    if dt <= longest * (1.0 + 1e-6):
        return (dt,)
    halvings = math.ceil(math.log2(dt / longest) - 1e-6)
    shortest = dt / 2**halvings
    return (shortest, *(shortest * 2**k for k in range(halvings)))


def step_in_parts(step: Callable[[float, float], StepInfo], t: float, parts: tuple[float, ...]) -> StepInfo:
    """Take the parts of a step from t one after the other. Iterations and notes are those of all, the rest of the last.

    step: takes one from a time with a length [s]. Raises StepFailed.
    """
    iterations, notes = 0, list[str]()
    for length in parts:
        info = step(t, length)
        t += length
        iterations += info.iterations
        notes += info.notes
    return StepInfo(iterations, info.residuals, info.numbers, tuple(notes))
