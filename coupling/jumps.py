"""Steps end where given velocities jump, and the scheme starts anew from there.

A jump within a step is an impulse that formulas over several steps count wrongly, and give back in the next ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from coupling.divided import step_in_parts
from solvers.api import Scheme, State, StepInfo

#: Distance from an end of a step, over its length, within which a jump is there.
NEAR_JUMP = 1e-3
#: Distance from a jump, over the length of the step, at which the step before it ends: velocities are those before.
BEFORE_JUMP = 1e-6


class Restarting(Scheme, Protocol):
    """A scheme that may start in the middle of a run."""

    #: Whether it divides steps there. A flow alone need not: it has no velocities of its own bodies to find.
    divides: bool

    #: Whether it can: elastic bodies in a flow by backward Euler keep their scheme, which needs equal steps.
    @property
    def can_start(self) -> bool: ...

    def start_anew(self, t: float, dt: float) -> None:
        """Prepare a step of length dt [s] from t, at which, or in which, given velocities jump (collective)."""
        ...


class AtJumps:
    """Implements `Scheme`: takes the steps of another one in parts between jumps."""

    def __init__(self, scheme: Restarting, jumps: Sequence[float]):
        """jumps: their times [s], in order."""
        self._scheme, self._jumps = scheme, jumps

    def step(self, t: float, dt: float) -> StepInfo:
        """One step from t to t + dt. Raises StepFailed."""
        at_end = [jump for jump in self._jumps if abs(jump - t - dt) <= NEAR_JUMP * dt]
        return step_in_parts(self._take, t, parts(t, dt, self._jumps if self._scheme.divides else at_end))

    def _take(self, t: float, dt: float) -> StepInfo:
        # the impulse of a jump within a step acts in the next one, too: both have the mean velocity of their way
        since = NEAR_JUMP if self._scheme.divides else 1.0 + NEAR_JUMP
        if any(-since * dt <= jump - t < (1.0 - NEAR_JUMP) * dt for jump in self._jumps):
            self._scheme.start_anew(t, dt)
        return self._scheme.step(t, dt)

    def save(self) -> State:
        return self._scheme.save()

    def restore(self, state: State) -> None:
        self._scheme.restore(state)


def parts(t: float, dt: float, jumps: Sequence[float]) -> tuple[float, ...]:
    """Lengths [s] of the parts of a step from t that end just before jumps, and at t + dt."""
    inside = [jump for jump in jumps if t + NEAR_JUMP * dt < jump < t + (1.0 + NEAR_JUMP) * dt]
    ends = [jump - BEFORE_JUMP * dt for jump in inside]
    if not inside or inside[-1] < t + (1.0 - NEAR_JUMP) * dt:
        ends.append(t + dt)
    return tuple(end - begin for begin, end in zip([t, *ends], ends, strict=False))
