"""Balances of the interface: action against reaction, momentum that crosses it, and power."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from solvers.api import Array, State
from solvers.fluid.balances import Balances
from solvers.fluid.field import Fluid

if TYPE_CHECKING:
    from coupling.coupled import Coupled


#: columns of the history -> attributes
COLUMNS = {
    "interface.force": "force",
    "interface.momentum": "momentum",
    "interface.power": "power",
    "interface.work": "work",
    "fluid.loss": "loss",
}


class Balance:
    """What the last step left over."""

    def __init__(self, fluid: Fluid) -> None:
        self._of_fluid = Balances(fluid)
        self.force = 0.0  #: |force on the structure - reaction of the fluid| / |reaction|, 1
        self.momentum = 0.0  #: |force on all bodies - what it is by the momentum of the fluid| [N]
        self.power = 0.0  #: of the fluid on the structure [W]
        self.loss = 0.0  #: power that the method takes from the fluid [W]
        self.work = 0.0  #: work that fluid and structure count differently in all steps [J]

    def add_step(self, coupled: Coupled, carried: Array) -> None:
        """`carried`: force [N] on the vertices in the structure's balance."""
        interface, reaction = coupled.interface, coupled.force()
        size = float(np.abs(reaction).sum())
        self.force = float(np.abs(carried - reaction).sum()) / size if size > 0.0 else 0.0
        total = sum(force.sum(axis=0) for force in coupled.fluid.force().values())
        of_fluid, self.loss = self._of_fluid()
        missed = total + (carried - reaction).sum(axis=0) - of_fluid
        self.momentum = float(np.linalg.norm(missed))
        structure_moves = interface.displacement() - interface.old
        self.power = float((reaction * interface.velocity(interface.now)).sum())
        self.work += float((carried * structure_moves).sum()) - coupled.fluid.dt * self.power

    def numbers(self) -> dict[str, float]:
        """Columns of the history."""
        return {column: getattr(self, name) for column, name in COLUMNS.items()}

    def save(self) -> State:
        return {name: getattr(self, name) for name in COLUMNS.values()}

    def restore(self, state: State) -> None:
        for name in COLUMNS.values():
            setattr(self, name, state[name])
