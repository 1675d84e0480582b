"""Balances of the interface: the load in the solid's balance against the force of the fluid, as forces and as work."""

from __future__ import annotations

import numpy as np

from coupling.interface import Interface
from coupling.ports import Flow, Solid
from solvers.api import Array, State

#: columns of the history -> attributes
COLUMNS = {
    "interface.force": "force",
    "interface.momentum": "momentum",
    "interface.power": "power",
    "interface.work": "work",
    "fluid.loss": "loss",
}


class Balance:
    """Residuals of force and work of the last step.

    With the fluid's force f at the end of the step and f_n at its start, the load in the solid's balance is the mean
    m = w f + (1 - w) f_n. It is compared with b, which is computed without it: the sum of inertia, damping, inner
    forces, own loads and contact.

        force = |b - m| / |m|,  work = sum over steps of b . (d - d_n) - dt f . g
    """

    def __init__(self, flow: Flow, solid: Solid, interface: Interface) -> None:
        self._flow, self._solid, self._interface = flow, solid, interface
        self.force = 0.0  #: |load that the solid took - mean load by the fluid| / |that load|, 1
        self.momentum = 0.0  #: |force on all bodies - what it is by the momentum of the fluid| [N]
        self.power = 0.0  #: of the fluid on the solid [W]
        self.loss = 0.0  #: power that the method takes from the fluid [W]
        self.work = 0.0  #: of the solid's load less that of the fluid's force, all steps [J]
        self.given: Array  #: load [N] by the fluid at the end of the last step, as `Solid.reduced` has it

    def start(self) -> None:
        """The state before the first step; the solid starts without the fluid's force."""
        self.given = self._solid.taken_at_start()

    def add_step(self, dt: float) -> None:
        """After both have accepted a step of length dt [s]."""
        flow, interface, solid = self._flow, self._interface, self._solid
        by_surface = flow.force()
        at_vertices = interface.join(by_surface)
        before, self.given = self.given, solid.reduced(at_vertices)
        weight = solid.force_weight
        mean = weight * self.given + (1.0 - weight) * before
        taken = solid.taken()
        size = float(np.linalg.norm(mean))
        self.force = float(np.linalg.norm(taken - mean)) / size if size > 0.0 else 0.0
        of_fluid, self.loss = flow.balances()
        total = sum(force.sum(axis=0) for force in by_surface.values())
        self.momentum = float(np.linalg.norm(total - of_fluid))
        self.power = float((at_vertices * interface.velocity(interface.now)).sum())
        self.work += float((taken * solid.moved()).sum()) - dt * self.power

    def numbers(self) -> dict[str, float]:
        """Columns of the history."""
        return {column: getattr(self, name) for column, name in COLUMNS.items()}

    def save(self) -> State:
        return {"given": self.given.copy()} | {name: getattr(self, name) for name in COLUMNS.values()}

    def restore(self, state: State) -> None:
        self.given = state["given"].copy()
        for name in COLUMNS.values():
            setattr(self, name, state[name])
