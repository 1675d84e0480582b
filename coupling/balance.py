"""Balances of the interface: action against reaction, and the power that crosses it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from solvers.api import Array, State

if TYPE_CHECKING:
    from coupling.coupled import Coupled


class Balance:
    """What the last step left over."""

    def __init__(self) -> None:
        self.force = 0.0  #: |force on the structure - reaction of the fluid| / |reaction|, 1
        self.work = 0.0  #: work that fluid and structure count differently in all steps [J]

    def add_step(self, coupled: Coupled, carried: Array) -> None:
        """`carried`: force [N] on the vertices in the structure's balance."""
        interface, reaction = coupled.interface, coupled.force()
        size = float(np.abs(reaction).sum())
        self.force = float(np.abs(carried - reaction).sum()) / size if size > 0.0 else 0.0
        structure_moves = interface.displacement() - interface.old
        dt = coupled.fluid.dt
        fluid_moves = dt * interface.velocity(interface.now)
        self.work += float((carried * structure_moves).sum() - (reaction * fluid_moves).sum())

    def numbers(self) -> dict[str, float]:
        return {"interface.force": self.force, "interface.work": self.work}

    def save(self) -> State:
        return {"force": self.force, "work": self.work}

    def restore(self, state: State) -> None:
        self.force, self.work = state["force"], state["work"]
