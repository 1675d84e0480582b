"""A solid and a flow with their interface: what both coupling schemes share."""

from __future__ import annotations

from collections.abc import Sequence

from coupling.balance import Balance
from coupling.interface import DrySide, Interface
from coupling.ports import Flow, Solid, Start
from solvers.api import Array, State


class Coupled:
    """The two parts at one time; collective calls."""

    def __init__(self, flow: Flow, solid: Solid, dry_sides: Sequence[DrySide] = (), start: Start | None = None):
        self.flow, self.solid, self.start = flow, solid, start
        self.notes: list[str] = []  #: what the user should know of the start
        self.interface = Interface(solid, flow.scheme.times, dry_sides)
        self.balance = Balance(flow, solid, self.interface)

    def initialise(self, t: float, dt: float, *, with_solid: bool = False) -> None:
        """Both at the first time, the flow around the solid as it starts; with_solid: solved as one."""
        self.solid.initialise(t, dt)
        self.interface.initialise()
        self.flow.initialise(t, dt)
        self.flow.move(self.interface.move(self.interface.now), with_solid=with_solid)
        self.balance.start()

    def begin_step(self, t: float, dt: float) -> None:
        """Boundary and loads at t + dt, both as they were at t."""
        self.flow.begin_step(t, dt)
        self.interface.begin_step(self.flow.current.difference)
        self.solid.begin_step(t, dt)

    def predict(self, t: float) -> None:
        """Predict both at t.

        Cut the grid at the old positions before that: cells that the surface leaves keep their ghost penalty.
        """
        self.flow.predict()
        self.solid.predict(t)

    def end_step(self) -> None:
        """Accept the step."""
        self.solid.end_step()
        self.flow.end_step()
        self.balance.add_step(self.flow.current.dt)

    def take_notes(self) -> tuple[str, ...]:
        """What the user should know of this step, and once of the start."""
        notes = (*self.notes, *self.flow.notes)
        self.notes.clear()
        return notes

    def force(self) -> Array:
        """Force [N] of the fluid on the vertices, shape (n, dim)."""
        return self.interface.join(self.flow.force())

    def save(self) -> State:
        return {
            "fluid": self.flow.save(),
            "structure": self.solid.save(),
            "interface": self.interface.save(),
            "balance": self.balance.save(),
        }

    def restore(self, state: State) -> None:
        self.solid.restore(state["structure"])
        self.flow.restore(state["fluid"])
        self.interface.restore(state["interface"])
        self.balance.restore(state["balance"])
