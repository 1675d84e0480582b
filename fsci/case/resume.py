"""The case of a resumed run: which settings may change."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fsci.case.case import Case
from fsci.case.errors import CaseError, Place, Problem
from fsci.case.load import load_case

#: Settings, or sections of them, that the state of a run does not depend on.
CHANGEABLE = (
    "title",
    "time.end",
    "time.step",
    "time.retry",
    "output",
    "solver",
    "verify",
    "coupling.relaxation",
    "coupling.tolerance",
    "coupling.tolerance_absolute",
    "coupling.max_iterations",
)


def resumed_case(folder: Path, changes: Sequence[tuple[str, str]] = ()) -> Case:
    """The case of a results folder with changes as of `load_case`; raises CaseError for settings that must stay."""
    fixed = [change for change in changes if not _changeable(change[0])]
    if fixed:
        allowed = ", ".join(CHANGEABLE)
        raise CaseError(
            Problem(place(change), f"'{change[0]}' cannot change when a run is resumed; what can: {allowed}")
            for change in fixed
        )
    return load_case(folder / "case.yaml", changes)


def end_error(case: Case, changes: Sequence[tuple[str, str]], reached: float) -> CaseError | None:
    """The error of a new end that lies before the time reached [s]."""
    ends = [change for change in changes if change[0] == "time.end"]
    if not ends or case.time.end > reached:
        return None
    return CaseError([Problem(place(ends[-1]), f"'end' must be later than {reached:g}, the time of the checkpoint")])


def place(change: tuple[str, str]) -> Place:
    """Position of a change on the command line."""
    return Place(f"--set {change[0]}={change[1]}")


def _changeable(dotted: str) -> bool:
    return any(dotted == name or dotted.startswith(f"{name}.") for name in CHANGEABLE)
