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
        """Predict the fields at t: displacements on a parabola, unless the structure has a predictor of its own.

        Cut the grid at the old positions before that: cells that the surface leaves keep their ghost penalty.
        """
        structure = self.structure
        self.fluid.predict()
        held, now = structure.held, structure.now
        own_predictor = not np.array_equal(held.free_part(now.u), held.free_part(structure.old.u))
        if not structure.comm.allreduce(own_predictor, op=MPI.LOR):
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
            "predictor": self._save_predictor(),
        }

    def _save_predictor(self) -> State:
        """Three displacements at all times, so that all states have the same parts."""
        displacements = [*self.predictor.displacements, *[self.structure.now.u] * 3][:3]
        by_name: State = {str(i): self.structure.per_body(u) for i, u in enumerate(displacements)}
        return by_name | {"times": list(self.predictor.times)}

    def restore(self, state: State) -> None:
        self.structure.restore(state["structure"])
        self.fluid.restore(state["fluid"])
        self.interface.restore(state["interface"])
        self.balance.restore(state["balance"])
        predictor, self.predictor.times = state["predictor"], list(state["predictor"]["times"])
        self.predictor.displacements = [
            self.structure.from_bodies(predictor[str(i)]) for i in range(len(self.predictor.times))
        ]
