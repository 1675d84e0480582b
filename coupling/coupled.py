"""Fluid and structure with their interface: what both coupling schemes share."""

from __future__ import annotations

from dataclasses import dataclass, field

from coupling.balance import Balance
from coupling.interface import Interface
from solvers.api import Array, State
from solvers.fluid.field import Fluid
from solvers.structure.field import Structure


@dataclass
class Coupled:
    """The two fields at one time; collective calls."""

    fluid: Fluid
    structure: Structure
    interface: Interface
    balance: Balance = field(init=False)

    def __post_init__(self) -> None:
        self.balance = Balance(self.fluid)

    def initialise(self, t: float, dt: float) -> None:
        """Both fields at the first time, the fluid around the structure as it starts."""
        self.structure.initialise(t, dt)
        self.interface.now = self.interface.displacement()
        self.interface.old = self.interface.now.copy()
        self.fluid.initialise(t, dt)
        self.fluid.move(self.interface.move(self.interface.now))

    def begin_step(self, t: float, dt: float) -> None:
        self.fluid.begin_step(t, dt)
        self.interface.begin_step(self.fluid.difference)
        self.structure.begin_step(t, dt)

    def end_step(self, force: Array) -> None:
        """Accept the step; `force` [N] on the vertices is what the structure has carried."""
        self.structure.end_step()
        self.fluid.end_step()
        self.balance.add_step(self, force)

    def force(self) -> Array:
        """Force [N] of the fluid on the vertices, shape (n, dim)."""
        return self.interface.join(self.fluid.force())

    def save(self) -> State:
        return {
            "fluid": self.fluid.save(),
            "structure": self.structure.save(),
            "interface": self.interface.save(),
            "balance": self.balance.save(),
        }

    def restore(self, state: State) -> None:
        self.structure.restore(state["structure"])
        self.fluid.restore(state["fluid"])
        self.interface.restore(state["interface"])
        self.balance.restore(state["balance"])
