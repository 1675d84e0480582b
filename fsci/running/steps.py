"""Steps of a case: its clock, its state at the first time, and steps that are halved where they fail."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from fsci.case import Case
from fsci.running.cause import alike
from fsci.running.clock import Clock
from fsci.running.watch import Watched
from solvers.api import State, StepFailed, StepInfo

if TYPE_CHECKING:
    from fsci.builder.build import Simulation

_NO_START = (
    "contact surfaces have no mass in dynamics, and no equilibrium was found for the loads and the overlap at the "
    "start; increase both from zero in time"
)


def clock_of(case: Case) -> Clock:
    """The clock of a case at its start.

    A steady flow does not depend on the step: half of it is the same problem again, with bodies or without.
    """
    time = case.time
    steady = case.fluid is not None and case.fluid.scheme == "steady"
    return Clock(time.start, time.end, time.step, 0 if steady else time.retry.halvings, time.retry.recover_after)


def initialise(case: Case, simulation: Simulation, scheme: Watched, dt: float) -> None:
    """Set the state at the first time, for steps of length dt [s] (collective).

    Raises CaseError if it cannot be computed: a smaller step would not help.
    """
    try:
        simulation.initialise(case.time.start, dt)
        scheme.start(case.time.start)
    except StepFailed as failure:
        if case.contact is None:
            raise case.error(("structure",), str(failure)) from None
        raise case.error(("contact",), f"{_NO_START}: {failure}") from None


def take_step(
    scheme: Watched,
    clock: Clock,
    state: State,
    explained: Callable[[StepFailed], StepFailed],
    repeat: Callable[[StepFailed], None],
    give_up: Callable[[StepFailed], None],
) -> StepInfo:
    """One step from `state`, which the scheme has, of length clock.dt at the end (collective). The clock stays.

    A step that fails is taken again with half of its length, after `repeat(failure)`. Raises StepFailed if that cannot
    help, with the scheme as it was, after `give_up(failure)`, which meets the last iterate. `explained` adds the cause.
    """
    earlier: StepFailed | None = None
    while True:
        try:
            return scheme.step(clock.time, clock.dt)
        except StepFailed as failed:
            failure = explained(failed)
            if unchanged := earlier is not None and alike(earlier, failure):
                failure = failure.with_reason(
                    f"{failure.reason}; as with twice the step, so that shorter ones do not help"
                )
            if failure.hopeless or unchanged or not clock.halve():
                give_up(failure)
                scheme.restore(state)
                raise failure from None
            scheme.restore(state)
            state = scheme.save()
            repeat(failure)
            earlier = failure
