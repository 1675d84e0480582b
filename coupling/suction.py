"""The cause of steps that fail because contact under suction has no state."""

from __future__ import annotations

from coupling.coupled import Coupled
from solvers.api import StepFailed

#: While contact is closed, its force would have to pull, and while it is open, the fluid closes it.
NO_STATE = (
    "a fluid at {pull:.3g} Pa below zero pulls at bodies that are dry where they touch, and may have no state open or "
    "closed: 'contact.film.zone: wetted' gives closed contact the pressure around it"
)


def with_cause(coupled: Coupled, failure: StepFailed, *, cycles: bool) -> StepFailed:
    """The failure of a step, with the cause where no smaller step helps (collective).

    cycles: contact opens and closes again and again, on any process.
    """
    pull = coupled.flow.suction()
    if not cycles or pull <= coupled.solid.contact_pressure():  # a larger load holds contact closed
        return failure
    return failure.with_reason(f"{failure.reason}; {NO_STATE.format(pull=pull)}")
