"""Balances of the interface, force and work, and the sentinel that looks at them.

The load in the balance of the solid is compared with the force of the fluid.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.interface import Interface
from coupling.ports import Flow, Solid
from solvers.api import Array, Finding, State

#: Columns of the history -> attributes of `Balance`.
BALANCE_COLUMNS = {
    "interface.force": "force",
    "interface.momentum": "momentum",
    "interface.power": "power",
    "interface.work": "work",
    "fluid.loss": "loss",
}

#: Share of the energy and of the impulse that have passed above which there is a warning.
SHARE_LOST = 0.05


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
        mean = solid.mean_load(before, self.given)
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
        return {column: getattr(self, name) for column, name in BALANCE_COLUMNS.items()}

    def save(self) -> State:
        return {"given": self.given.copy()} | {name: getattr(self, name) for name in BALANCE_COLUMNS.values()}

    def restore(self, state: State) -> None:
        self.given = state["given"].copy()
        for name in BALANCE_COLUMNS.values():
            setattr(self, name, state[name])


class InterfaceSentinel:
    """Implements `Sentinel`: energy and momentum pass from one part to the other, and none is made on the way.

    The two time schemes weight the forces at both ends of a step differently. So the work of the last step is not known
    better than the larger one of what the solid and the fluid count, nor than their difference where the force changes
    its sign: up to this the sum may be wrong. A loss is not reported: where it does not vanish, the schemes that were
    chosen explain it.
    """

    def __init__(self, balance: Balance, solid: Solid, *, steady: bool):
        """steady: nothing moves, so that no energy passes."""
        self._balance, self._solid, self._steady = balance, solid, steady
        #: energy that has passed at surfaces or at walls and patches, whichever is more, sum over steps [J]
        self._passed = 0.0
        self._impulse = 0.0  #: of the fluid on all vertices, sum of absolute values [N s]
        self._missed = 0.0  #: impulse that the momentum of the fluid lacks [N s]
        self._unsolved = 0.0  #: impulse that the residuals of its equations explain [N s]

    def start(self, t: float) -> None:
        """Nothing has passed."""

    def look(self, t: float, dt: float) -> Sequence[Finding]:
        """Energy from nothing, and momentum that is lost."""
        balance, found = self._balance, []
        taken, given = balance.last_works
        larger = max(abs(taken), abs(given))
        last = max(larger, abs(taken - given))
        self._passed += max(larger, dt * abs(balance.supplied))
        self._impulse += dt * balance.load
        self._missed += dt * balance.momentum
        self._unsolved += dt * balance.unsolved
        exchanged = max(self._passed, self._solid.exchanged())
        if not self._steady and balance.work - last > SHARE_LOST * exchanged:
            message = (
                f"at the surfaces in the fluid {balance.work:.3g} [energy] were made of nothing, "
                f"{balance.work / exchanged:.0%} of the energy that the scene has exchanged: the step "
                "does not resolve how they move; take a smaller 'step', or 'scheme: bdf2' with smooth starts"
            )
            found.append(Finding("energy", "interface", balance.work, message))
        if self._missed > max(SHARE_LOST * self._impulse, self._unsolved):
            message = (
                "the forces of the fluid on the bodies differ from its balance of momentum by "
                f"{balance.momentum:.3g} [force], {self._missed:.3g} of {self._impulse:.3g} [impulse] so far: forces "
                "are not reliable. Take a smaller tolerance of Newton's method, or finer cells"
            )
            found.append(Finding("momentum", "fluid", balance.momentum, message))
        return found

    def save(self) -> State:
        return {"sums": [self._passed, self._impulse, self._missed, self._unsolved]}

    def restore(self, state: State) -> None:
        self._passed, self._impulse, self._missed, self._unsolved = state["sums"]
