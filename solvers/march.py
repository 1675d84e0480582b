"""Steps through time for scripts: one system, steps of one size."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from solvers.api import StepInfo


class Marching(Protocol):
    """A field alone, or a coupling scheme."""

    def initialise(self, t: float, dt: float) -> None: ...
    def step(self, t: float, dt: float) -> StepInfo: ...


def march(system: Marching, end: float = 1.0, steps: int = 1, start: float = 0.0) -> Iterator[tuple[float, StepInfo]]:
    """Initialise, then yield (time [s], what the step took) after each of `steps` equal steps. Raises StepFailed.

    Steady and static problems take one step; a static load in parts takes several. Collective.
    """
    dt = (end - start) / steps
    system.initialise(start, dt)
    for number in range(steps):
        t = start + number * dt
        info = system.step(t, dt)
        yield t + dt, info
