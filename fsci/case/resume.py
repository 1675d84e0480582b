"""The case of a resumed run: what differs from the case of its checkpoint, and which settings may."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from fsci.case.case import Case
from fsci.case.errors import CaseError, Place, Problem
from fsci.case.fluid import KINDS_OF_PATCH
from fsci.case.settings import Settings, differences, dotted, in_words, settings_of

Keys = tuple[str | int, ...]

#: Settings, or sections of them, with which a state keeps its meaning: it has the same unknowns in the same order, and
#: the same kinds of values. These are loads, motions, materials, probes, outputs, tolerances. A star is any name.
CHANGEABLE = (
    "title",
    "units",
    "time.end",
    "time.step",
    "time.retry",
    "curves",
    "structure.dynamics.*",
    *(
        f"structure.bodies.*.{name}"
        for name in (
            *("material", "supports", "springs", "gravity", "body_force", "tractions", "pressures", "line_forces"),
            *("active", "pre_stretch", "point_forces", "point_springs", "slip_length"),
        )
    ),
    *(f"fluid.{name}" for name in ("density", "viscosity", "gravity", "body_force", "dynamics")),
    *(f"fluid.patches.*.{kind}" for kind in KINDS_OF_PATCH if kind != "periodic"),
    "fluid.patches.*.rate",
    *(f"fluid.bodies.*.{name}" for name in ("motion", "slip_length")),
    *(
        f"{body}.{name}"
        for body in ("fluid.bodies.*.free", "rigid.bodies.*", "contact.obstacles.*.free")
        for name in ("density", "gravity", "springs", "loads", "held", "leaves")
    ),
    *(f"rigid.{name}" for name in ("gravity", "dynamics")),
    *(f"contact.{name}" for name in ("friction", "restitution", "obstacles.*.motion", "rigid_pairs", "c_n")),
    *(f"contact.pairs.*.{name}" for name in ("friction", "interference")),
    *(f"coupling.{name}" for name in ("relaxation", "reuse", "tolerance", "tolerance_absolute", "max_iterations")),
    "probes",
    *(f"output.{name}" for name in ("fields_every", "checkpoint_every", "residuals")),
    "verify",
    "solver",
)

#: Why others stay, by the last name of the setting.
_REASONS_TO_STAY = {
    "start": "the run has begun at that time",
    "format": "the outputs so far have it",
    **dict.fromkeys(
        ("initial_displacement", "initial_velocity", "initial_angular_velocity"),
        "it counts at the start only, which is over",
    ),
}
_REASON = "the state of the run belongs to it"
_ANEW = "change it back, or compute the case anew with fsci run"


@dataclass(frozen=True)
class Change:
    """A setting that differs from that of the checkpoint."""

    keys: Keys
    old: Any  #: None: it was not set
    new: Any

    def __str__(self) -> str:
        return f"{dotted(self.keys)}: {in_words(self.old)} -> {in_words(self.new)}"

    def concerns(self, *patterns: str) -> bool:
        """Whether it is one of these settings, or within one of these sections; a star is any name."""
        return any(_matches(self.keys, pattern.split(".")) for pattern in patterns)


def changed(case: Case, before: Settings) -> list[Change]:
    """The settings that differ from those of the checkpoint. Raises CaseError with all that must stay."""
    found = [Change(*difference) for difference in differences(before, settings_of(case))]
    fixed = [change for change in found if not change.concerns(*CHANGEABLE)]
    if fixed:
        raise CaseError(
            problem
            for change in fixed
            for problem in case.error(change.keys, _refusal(change.keys, change.old, change.new)).problems
        )
    return found


def meshes_changed(case: Case, before: dict[str, str], now: dict[str, str]) -> Iterator[Problem]:
    """Problems of the meshes, by the sections that they belong to, that are others than those of the checkpoint."""
    for section in before.keys() & now.keys():
        if before[section] != now[section]:
            keys = (*section.split("."), "mesh")
            yield from case.error(keys, _refusal(keys, before[section], now[section])).problems


def end_error(case: Case, changes: Sequence[tuple[str, str]], reached: float) -> CaseError | None:
    """The error of a new end that lies before the time reached [s]."""
    ends = [change for change in changes if change[0] == "time.end"]
    if not ends or case.time.end > reached:
        return None
    place = Place(f"--set {ends[-1][0]}={ends[-1][1]}")
    return CaseError([Problem(place, f"'end' must be later than {reached:g}, the time of the checkpoint")])


def _refusal(keys: Keys, old: object, new: object) -> str:
    reason = _REASONS_TO_STAY.get(str(keys[-1]), _REASON)
    was = f"{dotted(keys)} was {in_words(old)}, is {in_words(new)}"
    return f"{was}: it cannot change when a run is resumed, {reason}; {_ANEW}"


def _matches(keys: Keys, pattern: Sequence[str]) -> bool:
    return len(keys) >= len(pattern) and all(word in ("*", key) for key, word in zip(keys, pattern, strict=False))
