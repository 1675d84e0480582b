"""Energies of the structure, and the balance that tells whether time integration and Newton were right."""

from __future__ import annotations

from typing import TYPE_CHECKING

from solvers.api import State

if TYPE_CHECKING:
    from solvers.structure.field import Structure


class EnergyBalance:
    """kinetic + internal + damping + friction = initial energy + work of loads and supports, but for time steps [J]."""

    def __init__(self) -> None:
        self.kinetic = self.internal = self.work = self.damping = self.friction = self.initial = 0.0

    def start(self, structure: Structure) -> None:
        """Measure the initial energy."""
        self._measure(structure)
        self.friction = 0.0 if structure.constraint is None else structure.constraint.friction_work
        self.initial = self.kinetic + self.internal + self.friction

    def _measure(self, structure: Structure) -> None:
        self.kinetic = structure.time.kinetic_energy(structure)
        self.internal = sum(body.internal_energy() for body in structure.bodies)

    def add_step(self, structure: Structure) -> None:
        """Work of the averaged external forces and of the supports over the accepted step."""
        du = structure.now.u - structure.old.u
        external, damping = structure.time.averaged_forces(structure)
        self.work += structure.dot(external, du) + structure.dot(structure.residual_force, structure.held.part(du))
        self.damping += structure.dot(damping, du)
        self.friction = 0.0 if structure.constraint is None else structure.constraint.friction_work
        self._measure(structure)

    @property
    def error(self) -> float:
        """What the balance misses [J]."""
        return self.kinetic + self.internal + self.damping + self.friction - self.work - self.initial

    def save(self) -> State:
        return dict(vars(self))

    def restore(self, state: State) -> None:
        vars(self).update(state)
