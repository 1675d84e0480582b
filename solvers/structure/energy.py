"""Energies of the structure, and the balance that tells whether time integration and Newton were right."""

from __future__ import annotations

from solvers.api import State


class EnergyBalance:
    """kinetic + internal + damping + friction = initial energy + work of loads and supports, but for time steps [J]."""

    def __init__(self) -> None:
        self.kinetic = self.internal = self.work = self.damping = self.friction = self.initial = 0.0

    def start(self, kinetic: float, internal: float, friction: float) -> None:
        """The energies at the start [J]."""
        self.kinetic, self.internal, self.friction = kinetic, internal, friction
        self.initial = kinetic + internal + friction

    def add_step(self, work: float, damping: float, kinetic: float, internal: float, friction: float) -> None:
        """Work of loads and supports and loss by damping in an accepted step, and the energies at its end [J]."""
        self.work += work
        self.damping += damping
        self.kinetic, self.internal, self.friction = kinetic, internal, friction

    @property
    def error(self) -> float:
        """What the balance misses [J]."""
        return self.kinetic + self.internal + self.damping + self.friction - self.work - self.initial

    def save(self) -> State:
        return dict(vars(self))

    def restore(self, state: State) -> None:
        vars(self).update(state)
