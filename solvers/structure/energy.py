"""The energy balance of a structure, which measures the errors of time integration and of Newton's method."""

from __future__ import annotations

from collections.abc import Sequence

from solvers.api import Finding, State
from solvers.structure.deformation import RUNAWAY, LimitPoint

#: Share of the energy exchanged above which there is a warning.
EXCHANGED = 0.05


class EnergyBalance:
    """kinetic + internal + damping + friction = initial energy + work of loads and supports, up to time steps [J]."""

    def __init__(self) -> None:
        self.kinetic = self.internal = self.work = self.damping = self.friction = self.initial = 0.0
        #: the initial energy, and half of the sum of all |changes| since: each passes from one form to another [J]
        self.exchanged = 0.0
        self.last = 0.0  #: what the last step has exchanged [J]
        self.vanished = 0.0  #: work of the last step that is neither stored nor lost to damping or friction [J]
        #: by how much the balance may be wrong: between forces at both ends of steps, by residuals and rounding [J]
        self.doubt = 0.0

    def start(self, kinetic: float, internal: float, friction: float) -> None:
        """Set the energies at the start [J]."""
        self.kinetic, self.internal, self.friction = kinetic, internal, friction
        self.initial = kinetic + internal + friction
        self.exchanged = abs(kinetic) + abs(internal)

    def add_step(
        self,
        works: Sequence[float],
        damping: float,
        kinetic: float,
        internal: float,
        friction: float,
        doubt: float = 0.0,
    ) -> None:
        """Add an accepted step: works of loads and supports, loss by damping, and energies at its end [J]."""
        before = self.error
        changes = kinetic - self.kinetic, internal - self.internal, friction - self.friction, damping, *works
        self.last = 0.5 * sum(map(abs, changes))
        self.exchanged += self.last
        self.work += sum(works)
        self.damping += damping
        self.doubt += doubt
        self.kinetic, self.internal, self.friction = kinetic, internal, friction
        self.vanished = before - self.error

    def revalue(self, kinetic: float, internal: float) -> None:
        """Count a change of energies [J] at one time, by other materials or springs, as if it had been at the start."""
        self.initial += kinetic - self.kinetic + internal - self.internal
        self.kinetic, self.internal = kinetic, internal

    @property
    def error(self) -> float:
        """Residual of the balance [J]."""
        return self.kinetic + self.internal + self.damping + self.friction - self.work - self.initial

    def save(self) -> State:
        return dict(vars(self))

    def restore(self, state: State) -> None:
        vars(self).update(state)


class EnergySentinel:
    """Implements `Sentinel`: energy from nothing, and energy that is lost though the scheme dissipates none.

    A static structure that passes a limit point leaps to another equilibrium: what it would have as kinetic energy in
    dynamics is missing in the balance of that step.

    The energy at the end of a step and the mean forces over it differ by what the step itself exchanges. Up to this the
    balance may be wrong for a while, as at the start of a fall. Bodies that overlap at the start are pushed apart in
    the first step: in contact, its error is the energy of the overlap.
    """

    def __init__(self, energy: EnergyBalance, limit_point: LimitPoint, *, dissipates: bool, contact: bool = False):
        """dissipates: the time scheme loses energy by the user's choice, or contact does where steps are long."""
        self._energy, self._limit_point, self._dissipates, self._contact = energy, limit_point, dissipates, contact
        self._of_overlap: float | None = None  # [J]; None before the first step

    def start(self, t: float) -> None:
        """The balance keeps what it needs."""

    def allow_loss(self) -> None:
        """Contact that has come in loses energy where steps are long."""
        self._dissipates = True

    def look(self, t: float, dt: float) -> Sequence[Finding]:
        """What the balance shows at the end of a step."""
        return [*self._snap(t), *self._growth_or_loss()]

    def _snap(self, t: float) -> Sequence[Finding]:
        """A finding if the step has leapt: faster than usual, by work that has gone nowhere."""
        vanished, growth = self._energy.vanished, self._limit_point.growth()
        if vanished <= EXCHANGED * self._energy.last or growth < RUNAWAY:
            return []
        message = (
            f"the step to t = {t:.6g} moved bodies {growth:.2g} times as fast as usual, and {vanished:.3g} [energy] of "
            f"the work, {vanished / self._energy.last:.0%}, is nowhere: they snapped to another equilibrium, "
            "which dynamics may not find, or the step is too long; if it stays with a smaller 'step', take 'dynamics'"
        )
        return [Finding("snap", "structure", vanished, message)]

    def _growth_or_loss(self) -> Sequence[Finding]:
        """A finding if the balance does not hold."""
        energy = self._energy
        if self._of_overlap is None:
            self._of_overlap = energy.error if self._contact else 0.0
        error, exchanged = energy.error - self._of_overlap, energy.exchanged
        allowed = max(EXCHANGED * exchanged + energy.last, energy.doubt)
        if abs(error) <= allowed or (error < 0.0 and self._dissipates):
            return []
        share = f"by {abs(error):.3g} [energy], {abs(error) / exchanged:.0%} of the energy exchanged so far"
        if error > 0.0:
            what = f"the energy of the bodies has grown without external work, {share}"
        else:
            what = f"the bodies have lost energy that neither damping nor friction took, {share}"
        remedy = "the step does not resolve impacts or vibrations; take a smaller 'step'"
        return [Finding("energy", "structure", error, f"{what}: {remedy}")]

    def save(self) -> State:
        return {"of_overlap": self._of_overlap, "limit_point": self._limit_point.save()}

    def restore(self, state: State) -> None:
        self._of_overlap = state["of_overlap"]
        self._limit_point.restore(state["limit_point"])
