"""The sentinel of the interface: energy and momentum pass from one part to the other, and none is made on the way.

The two time schemes weight the forces at both ends of a step differently. So the work of the last step is not known
better than the larger one of what the solid and the fluid count: up to this the sum may be wrong. A loss is not
reported: where it does not vanish, the schemes that were chosen explain it.
"""

from __future__ import annotations

from collections.abc import Sequence

from coupling.balance import Balance
from coupling.ports import Solid
from solvers.api import Finding, State

#: Share of the energy and of the impulse that have passed above which there is a warning.
SHARE = 0.05


class InterfaceSentinel:
    """Implements `Sentinel`."""

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
        last = max(map(abs, balance.last_works))
        self._passed += max(last, dt * abs(balance.supplied))
        self._impulse += dt * balance.load
        self._missed += dt * balance.momentum
        self._unsolved += dt * balance.unsolved
        exchanged = max(self._passed, self._solid.exchanged())
        if not self._steady and balance.work - last > SHARE * exchanged:
            message = (
                f"at the surfaces in the fluid {balance.work:.3g} J were made of nothing, "
                f"{balance.work / exchanged:.0%} of the energy that the scene has exchanged: the step "
                "does not resolve how they move; take a smaller 'step', or 'scheme: bdf2' with smooth starts"
            )
            found.append(Finding("energy", "interface", balance.work, message))
        if self._missed > max(SHARE * self._impulse, self._unsolved):
            message = (
                "the forces of the fluid on the bodies differ from its balance of momentum by "
                f"{balance.momentum:.3g} N, {self._missed:.3g} of {self._impulse:.3g} N s so far: forces are not "
                "reliable. Take a smaller tolerance of Newton's method, or finer cells"
            )
            found.append(Finding("momentum", "fluid", balance.momentum, message))
        return found

    def save(self) -> State:
        return {"sums": [self._passed, self._impulse, self._missed, self._unsolved]}

    def restore(self, state: State) -> None:
        self._passed, self._impulse, self._missed, self._unsolved = state["sums"]
