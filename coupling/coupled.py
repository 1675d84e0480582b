"""A solid, a flow and their interface: the steps and states that both coupling schemes share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from coupling.balance import Balance
from coupling.interface import DrySide, Interface
from coupling.ports import Flow, Solid, Start
from coupling.sealing_layer import SealingLayer
from coupling.sentinel import InterfaceSentinel
from solvers.api import Array, State


class Coupled:
    """The two parts and their interface; all calls are collective."""

    def __init__(
        self,
        flow: Flow,
        solid: Solid,
        dry_sides: Sequence[DrySide] = (),
        start: Start | None = None,
        layers: Mapping[str, SealingLayer] = {},
    ):
        self.flow, self.solid, self.start = flow, solid, start
        self.notes: list[str] = []  #: notes to the user on the start
        self.interface = Interface(solid, flow.scheme.times, dry_sides, layers)
        self.balance = Balance(flow, solid, self.interface)
        self.sentinel = InterfaceSentinel(self.balance, solid, steady=flow.steady)

    def initialise(self, t: float, dt: float, *, with_solid: bool = False) -> None:
        """Set both parts to the first time, and cut the flow by the solid; with_solid: see `Flow.move`."""
        self.solid.initialise(t, dt)
        self.interface.initialise()
        self.flow.initialise(t, dt)
        self.flow.move(self.interface.move(self.interface.now), with_solid=with_solid)
        self.balance.start()

    def begin_step(self, t: float, dt: float) -> None:
        """Set boundary values and loads to t + dt; both parts keep their state at t."""
        self.flow.begin_step(t, dt)
        self.interface.begin_step(self.flow.current.difference)
        self.solid.begin_step(t, dt)

    def predict(self, t: float, *, with_pressure: bool = False) -> None:
        """Set the predictors of both parts for the time t [s]; with_pressure: see `Flow.predict`.

        Cut the grid at the old positions before that, so that cells that the surface leaves have the ghost penalty.
        """
        self.flow.predict(with_pressure=with_pressure)
        self.solid.predict(t)

    def end_step(self) -> None:
        """Accept the step."""
        self.solid.end_step()
        self.flow.end_step()
        self.balance.add_step(self.flow.current.dt)

    def take_notes(self) -> tuple[str, ...]:
        """Notes to the user on this step; those on the start are returned once."""
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
