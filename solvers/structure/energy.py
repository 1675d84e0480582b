"""The energy balance of a structure, which measures the errors of time integration and of Newton's method."""

from __future__ import annotations

from solvers.api import State

#: Gain of energy without external work, relative to the largest energy so far, above which there is a warning.
GAIN = 0.1


class EnergyBalance:
    """kinetic + internal + damping + friction = initial energy + work of loads and supports, up to time steps [J]."""

    def __init__(self) -> None:
        self.kinetic = self.internal = self.work = self.damping = self.friction = self.initial = 0.0
        self.largest = 0.0  #: largest sum of kinetic and internal energy so far
        self.warned = False

    def start(self, kinetic: float, internal: float, friction: float) -> None:
        """Set the energies at the start [J]."""
        self.kinetic, self.internal, self.friction = kinetic, internal, friction
        self.initial = kinetic + internal + friction

    def add_step(self, work: float, damping: float, kinetic: float, internal: float, friction: float) -> None:
        """Add an accepted step: work of loads and supports, loss by damping, and energies at its end [J]."""
        self.work += work
        self.damping += damping
        self.kinetic, self.internal, self.friction = kinetic, internal, friction

    def revalue(self, kinetic: float, internal: float) -> None:
        """Count a change of energies [J] at one time, by other materials or springs, as if it had been at the start."""
        self.initial += kinetic - self.kinetic + internal - self.internal
        self.kinetic, self.internal = kinetic, internal
        self.largest = max(self.largest, kinetic + internal)

    def warning(self) -> str:
        """A warning when the energy of moving bodies exceeds its bound for the first time, else an empty text."""
        before, self.largest = self.largest, max(self.largest, self.kinetic + self.internal)
        if self.warned or self.kinetic == 0.0 or before == 0.0 or self.error <= GAIN * before:
            return ""
        self.warned = True
        return (
            f"the energy of the bodies has grown without external work, by {self.error / before:.0%} of its maximum: "
            "the step does not resolve the impact; take a smaller 'step'"
        )

    @property
    def error(self) -> float:
        """Residual of the balance [J]."""
        return self.kinetic + self.internal + self.damping + self.friction - self.work - self.initial

    def save(self) -> State:
        return dict(vars(self))

    def restore(self, state: State) -> None:
        vars(self).update(state)
