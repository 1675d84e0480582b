"""The setting that made a step fail, where its formula has no finite value."""

from __future__ import annotations

from typing import Any

from fsci.case import Case
from fsci.case.expressions import missed_formula
from solvers.api import FailureKind, StepFailed

#: Residuals that two failures must have in common, and how closely. Two different steps have different loads: from the
#: second residual on nothing makes them equal by chance to 1 %, and four of them are more than a failure at once gives.
#: Press fits that fail have the same residuals to rounding with any step. Those of a belt, a seal, an arch and a strip
#: differ by 0.67 to 0.98: 1e-5 to 0.5 and 1 to 5 residuals tell them apart in the same way.
IN_COMMON, CLOSELY = 4, 0.01


def alike(one: StepFailed, other: StepFailed) -> bool:
    """Whether two attempts at a step failed with the same residuals, whatever its length."""
    if one.field != other.field or len(one.history) != len(other.history) or len(one.history) <= IN_COMMON:
        return False
    return all(abs(a - b) <= CLOSELY * max(a, b) for a, b in zip(one.history[1:], other.history[1:], strict=True))


def with_cause(failure: StepFailed, case: Case, begin: float, comm: Any) -> StepFailed:
    """The failure of a step from the time `begin` on, its reason with the setting that is not finite (collective)."""
    if failure.kind is not FailureKind.NOT_FINITE:
        return failure
    found = next(filter(None, comm.allgather(missed_formula(case, begin))), None)
    if found is None:
        return failure
    return failure.with_reason(f"{failure.reason} ({found})")
