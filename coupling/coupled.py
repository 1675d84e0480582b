"""A solid, a flow and their interface: the steps and states that both coupling schemes share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from coupling.balance import Balance, InterfaceSentinel
from coupling.impact import Impacts
from coupling.interface import DrySide, Interface
from coupling.ports import Flow, Solid, Start
from coupling.sealing_layer import SealingLayer
from solvers.api import Array, FailureKind, State, StepFailed

if TYPE_CHECKING:
    from coupling.near_walls import NearWalls

#: While contact is closed, its force would have to pull, and while it is open, the fluid closes it.
NO_STATE = (
    "a fluid at {pull:.3g} Pa below zero pulls at bodies that are dry where they touch, and may have no state open or "
    "closed: 'contact.film.zone: wetted' gives closed contact the pressure around it, "
    "and 'contact.film.roughness' lets fluid between flat surfaces that part"
)


class Coupled:
    """The two parts and their interface; all calls are collective."""

    def __init__(
        self,
        flow: Flow,
        solid: Solid,
        dry_sides: Sequence[DrySide] = (),
        start: Start | None = None,
        layers: Mapping[str, SealingLayer] = {},
        walls: NearWalls | None = None,
    ):
        """walls: faces of the box that elastic bodies may reach."""
        self.flow, self.solid, self.start, self.walls = flow, solid, start, walls
        self.notes: list[str] = []  #: notes to the user on the start
        self._dt = 0.0  #: length of the present step [s]
        self.longest_first = math.inf  #: longest part [s] of the first step, in which the flow may brake free bodies
        self.interface = Interface(solid, flow.times, dry_sides, layers)
        self.balance = Balance(flow, solid, self.interface)
        self.impacts = Impacts(solid, start)
        self.sentinel = InterfaceSentinel(self.balance, solid, steady=flow.steady)

    def initialise(self, t: float, dt: float, *, with_solid: bool = False) -> None:
        """Set both parts to the first time, and cut the flow by the solid; with_solid: see `Flow.move`."""
        if self.walls is not None:
            self.notes += self.walls.start(t, dt)
        self.solid.initialise(t, dt)
        self.interface.initialise()
        self.flow.initialise(t, dt)
        self.flow.move(self.interface.move(self.interface.now), with_solid=with_solid)
        self.balance.start()

    @property
    def longest_step(self) -> float:
        """[s]; longer ones are divided into parts."""
        return min(self.flow.longest_step, self.longest_first)

    def begin_step(self, t: float, dt: float) -> None:
        """Set boundary values and loads to t + dt; both parts keep their state at t."""
        self._dt = dt
        if self.walls is not None:
            self.notes += self.walls.approach(dt)
        self.impacts.begin_step()
        self.flow.begin_step(t, dt)
        self.interface.begin_step(self.flow.difference)
        self.solid.begin_step(t, dt)

    def predict(self, t: float, *, with_pressure: bool = False) -> None:
        """Set the predictors of both parts for the time t [s]; with_pressure: see `Flow.predict`.

        Cut the grid at the old positions before that, so that cells that the surface leaves have the ghost penalty.
        """
        self.flow.predict(with_pressure=with_pressure)
        self.solid.predict(t)

    def end_step(self) -> None:
        """Accept the step. Raises WallPassed and Impact."""
        if self.walls is not None:
            self.walls.require_apart()
        self.impacts.require_none()
        self.solid.end_step()
        self.flow.end_step()
        self.balance.add_step(self._dt)
        self.longest_first = math.inf

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
            "longest_first": self.longest_first,
            **({} if self.walls is None else {"walls": self.walls.save()}),
        }

    def restore(self, state: State) -> None:
        if self.walls is not None:
            self.walls.begin_restore(state["walls"])
        self.solid.restore(state["structure"])
        self.flow.restore(state["fluid"])
        self.interface.restore(state["interface"])
        self.balance.restore(state["balance"])
        self.longest_first = state["longest_first"]
        if self.walls is not None:
            self.walls.end_restore()


def suction(coupled: Coupled) -> float:
    """Suction [Pa] on dry contact that no larger load holds closed at the present iterate, else 0 (collective)."""
    pull = coupled.flow.suction()
    return pull if pull > coupled.solid.contact_pressure() else 0.0


def with_cause(failure: StepFailed, pull: float) -> StepFailed:
    """The failure of a step, with the cause where no smaller step helps.

    pull: the largest `suction` [Pa] at the iterates between which contact opens and closes again and again.
    """
    if pull <= 0.0:
        return failure
    return failure.with_reason(f"{failure.reason}; {NO_STATE.format(pull=pull)}", FailureKind.SUCTION)
