"""Fluid and structure with their interface: what both coupling schemes share."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI

from coupling.balance import Balance
from coupling.interface import Interface
from coupling.predict import Predictor
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
    predictor: Predictor = field(init=False)

    def __post_init__(self) -> None:
        self.balance, self.predictor = Balance(self.fluid, self.structure, self.interface), Predictor()

    def initialise(self, t: float, dt: float) -> None:
        """Both fields at the first time, the fluid around the structure as it starts."""
        self.structure.initialise(t, dt)
        self.interface.now = self.interface.displacement()
        self.interface.old = self.interface.now.copy()
        self.fluid.initialise(t, dt)
        self.fluid.move(self.interface.move(self.interface.now))
        self.balance.start()

    def begin_step(self, t: float, dt: float) -> None:
        """Boundary and loads at t + dt, both fields as they were at t."""
        self.fluid.begin_step(t, dt)
        self.interface.begin_step(self.fluid.difference)
        self.structure.begin_step(t, dt)
        self.predictor.add(t, self.structure.old.u)

    def predict(self, t: float) -> None:
        """First guess of the fields at t: places on a parabola, unless the structure has a guess of its own.

        Cut the grid at the old place before that: cells that the surface leaves keep their ghost penalty for the step.
        """
        structure = self.structure
        self.fluid.predict()
        held, now = structure.held, structure.now
        own_guess = not np.array_equal(held.free_part(now.u), held.free_part(structure.old.u))
        if not structure.comm.allreduce(own_guess, op=MPI.LOR):
            now.u[:] = held.part(now.u) + held.free_part(self.predictor.at(t))

    def end_step(self) -> None:
        """Accept the step."""
        self.structure.end_step()
        self.fluid.end_step()
        self.balance.add_step()

    def force(self) -> Array:
        """Force [N] of the fluid on the vertices, shape (n, dim)."""
        return self.interface.join(self.fluid.force())

    def save(self) -> State:
        return {
            "fluid": self.fluid.save(),
            "structure": self.structure.save(),
            "interface": self.interface.save(),
            "balance": self.balance.save(),
            "places": self._save_places(),
        }

    def _save_places(self) -> State:
        """Three of them at all times, so that all states have the same parts."""
        places = [*self.predictor.places, *[self.structure.now.u] * 3][:3]
        by_name: State = {str(i): self.structure.per_body(place) for i, place in enumerate(places)}
        return by_name | {"times": list(self.predictor.times)}

    def restore(self, state: State) -> None:
        self.structure.restore(state["structure"])
        self.fluid.restore(state["fluid"])
        self.interface.restore(state["interface"])
        self.balance.restore(state["balance"])
        times = list(state["places"]["times"])
        self.predictor.times = times
        self.predictor.places = [self.structure.from_bodies(state["places"][str(i)]) for i in range(len(times))]
