"""The setting that made a step fail, where its formula has no finite value."""

from __future__ import annotations

from typing import Any

from fsci.case import Case
from fsci.case.expressions import missed_formula
from solvers.api import StepFailed


def with_cause(failure: StepFailed, case: Case, begin: float, comm: Any) -> StepFailed:
    """The failure of a step from the time `begin` on, its reason with the setting that is not finite (collective)."""
    if "not a number" not in failure.reason:
        return failure
    found = next(filter(None, comm.allgather(missed_formula(case, begin))), None)
    if found is None:
        return failure
    return failure.with_reason(f"{failure.reason} ({found})")
