"""Time stepping for scripts: equal steps of one system."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from solvers.api import StepInfo


class Marching(Protocol):
    """A field alone, or a coupling scheme."""

    def initialise(self, t: float, dt: float) -> None: ...
    def step(self, t: float, dt: float) -> StepInfo: ...


def march(system: Marching, end: float = 1.0, steps: int = 1, start: float = 0.0) -> Iterator[tuple[float, StepInfo]]:
    """Initialise, then yield (time [s], StepInfo) after each of `steps` equal steps (collective). Raises StepFailed.

    Steady and static problems take one step; several steps apply a static load in parts.
    """
    dt = (end - start) / steps
    system.initialise(start, dt)
    for number in range(steps):
        t = start + number * dt
        info = system.step(t, dt)
        yield t + dt, info
