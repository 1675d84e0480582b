"""Balances of the interface: the load in the balance of the solid against the force of the fluid, force and work."""

from __future__ import annotations

import numpy as np

from coupling.interface import Interface
from coupling.ports import Flow, Solid
from solvers.api import Array, State

#: Columns of the history -> attributes of `Balance`.
COLUMNS = {
    "interface.force": "force",
    "interface.momentum": "momentum",
    "interface.power": "power",
    "interface.work": "work",
    "fluid.loss": "loss",
}


class Balance:
    """Residuals of force and work of the last step.

    Let f be the force of the fluid at the end of the step and f_n that at its start. The load in the balance of the
    solid is the mean m = w f + (1 - w) f_n. It is compared with b, which is computed without it: the sum of inertia,
    damping, internal forces, own loads and contact.

        force = |b - m| / |m|,  work = sum over steps of b . (d - d_n) - dt f . g
    """

    def __init__(self, flow: Flow, solid: Solid, interface: Interface) -> None:
        self._flow, self._solid, self._interface = flow, solid, interface
        self.force = 0.0  #: |b - m| / |m| of the last step, dimensionless
        self.unsolved = 0.0  #: sum of |residual| of the momentum of the fluid [N]
        self.momentum = 0.0  #: |force on all bodies - that by the balance of momentum of the fluid| [N]
        self.power = 0.0  #: power of the fluid on the solid [W]
        self.supplied = 0.0  #: power of walls and patches on the fluid [W]
        self.loss = 0.0  #: power that the fluid loses by the method [W]
        self.work = 0.0  #: work of b minus that of f, sum over all steps [J]
        self.last_works = (0.0, 0.0)  #: work of b and that of f in the last step [J]
        self.load = 0.0  #: sum of the magnitudes of the forces of the fluid on all vertices [N]
        self.given: Array  #: generalised force of the fluid at the end of the last step, see `Solid.reduced`

    def start(self) -> None:
        """Set the force at the start: that of the initial balance of the solid."""
        self.given = self._solid.taken_at_start()

    def add_step(self, dt: float) -> None:
        """Compute the balances of a step of length dt [s] that both parts have accepted."""
        flow, interface, solid = self._flow, self._interface, self._solid
        by_surface = flow.force()
        at_vertices = interface.join(by_surface)
        before, self.given = self.given, solid.reduced(at_vertices)
        weight = solid.force_weight
        mean = weight * self.given + (1.0 - weight) * before
        taken = solid.taken()
        size = float(np.linalg.norm(mean))
        self.force = float(np.linalg.norm(taken - mean)) / size if size > 0.0 else 0.0
        of_fluid, self.loss, self.supplied = flow.balances()
        total = sum(force.sum(axis=0) for force in by_surface.values())
        self.load = float(sum(np.linalg.norm(force, axis=1).sum() for force in by_surface.values()))
        self.unsolved = flow.unsolved()[0]
        self.momentum = float(np.linalg.norm(total - of_fluid))
        self.power = float((at_vertices * interface.velocity(interface.now)).sum())
        self.last_works = float((taken * solid.moved()).sum()), dt * self.power
        self.work += self.last_works[0] - self.last_works[1]

    def numbers(self) -> dict[str, float]:
        """Columns of the history."""
        return {column: getattr(self, name) for column, name in COLUMNS.items()}

    def save(self) -> State:
        return {"given": self.given.copy()} | {name: getattr(self, name) for name in COLUMNS.values()}

    def restore(self, state: State) -> None:
        self.given = state["given"].copy()
        for name in COLUMNS.values():
            setattr(self, name, state[name])
