"""Balances of the interface: what the structure took against what the fluid gave, force by force and as work."""

from __future__ import annotations

import numpy as np

from coupling.interface import Interface
from solvers.api import Array, State
from solvers.fluid.balances import Balances
from solvers.fluid.field import Fluid
from solvers.structure.field import Structure

#: columns of the history -> attributes
COLUMNS = {
    "interface.force": "force",
    "interface.momentum": "momentum",
    "interface.power": "power",
    "interface.work": "work",
    "fluid.loss": "loss",
}


class Balance:
    """What the last step left over.

    With the fluid's force f on the vertices at the end of the step and f_n at its start, the structure's balance asks
    for the mean m = w f + (1 - w) f_n. What the structure took is measured without it: its own balance, b, is inertia,
    damping, inner forces, own loads and contact.

        force = |b - m| / |m|,  work = sum over steps of b . (d - d_n) - dt f . g
    """

    def __init__(self, fluid: Fluid, structure: Structure, interface: Interface) -> None:
        self._fluid, self._structure, self._interface = fluid, structure, interface
        self._of_fluid = Balances(fluid)
        self.force = 0.0  #: |force that the structure took - mean force of the fluid| / |that force|, 1
        self.momentum = 0.0  #: |force on all bodies - what it is by the momentum of the fluid| [N]
        self.power = 0.0  #: of the fluid on the structure [W]
        self.loss = 0.0  #: power that the method takes from the fluid [W]
        self.work = 0.0  #: of the structure's load less that of the fluid's force, all steps [J]
        self.given: Array  #: force [N] of the fluid on the vertices at the end of the last step

    def start(self) -> None:
        """The state before the first step; the structure starts without the fluid's force."""
        self.given = self._interface.gather(self._structure.load_at_start())

    def add_step(self) -> None:
        """After both fields have accepted the step."""
        fluid, interface, structure = self._fluid, self._interface, self._structure
        by_surface = fluid.force()
        before, self.given = self.given, interface.join(by_surface)
        weight = structure.time.force_weight
        mean = weight * self.given + (1.0 - weight) * before
        taken = interface.gather(structure.averaged_load())
        size = float(np.linalg.norm(mean))
        self.force = float(np.linalg.norm(taken - mean)) / size if size > 0.0 else 0.0
        of_fluid, self.loss = self._of_fluid()
        total = sum(force.sum(axis=0) for force in by_surface.values())
        self.momentum = float(np.linalg.norm(total - of_fluid))
        self.power = float((self.given * interface.velocity(interface.now)).sum())
        moved = interface.gather(structure.now.u - structure.old.u)
        self.work += float((taken * moved).sum()) - fluid.dt * self.power

    def numbers(self) -> dict[str, float]:
        """Columns of the history."""
        return {column: getattr(self, name) for column, name in COLUMNS.items()}

    def save(self) -> State:
        return {"given": self.given.copy()} | {name: getattr(self, name) for name in COLUMNS.values()}

    def restore(self, state: State) -> None:
        self.given = state["given"].copy()
        for name in COLUMNS.values():
            setattr(self, name, state[name])
