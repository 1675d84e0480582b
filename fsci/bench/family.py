"""Error against time: a case at several resolutions and with several options, with errors by its `verify`."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fsci.bench.program import run_timed
from fsci.bench.table import Row

CASES = Path(__file__).parents[2] / "cases"

Settings = Mapping[str, Any]  #: dotted name of a setting -> its value

TIME, ERROR, UNKNOWNS, MEMORY, FRONT = "time [s]", "error [%]", "unknowns", "memory [MB]", "front"


@dataclass(frozen=True)
class Family:
    """A case whose `verify` has published or exact values, and how it is varied.

    A run has the settings of all, of its option and of its resolution.
    """

    case: str | Mapping[str, Any]  #: folder in `cases/`, or the content of a case
    words: str
    options: Mapping[str, Settings]  #: compared options: elements, schemes
    resolutions: Mapping[str, Settings]  #: coarse to fine
    values: tuple[str, ...] = ()  #: columns whose errors are used; default: all of `verify`
    all: Settings | None = None

    def run(self) -> list[Row]:
        """A row for each option and resolution; those on the Pareto front have a star."""
        with TemporaryDirectory() as name:
            folder = Path(name)
            case = folder if isinstance(self.case, Mapping) else CASES / self.case
            if isinstance(self.case, Mapping):
                (folder / "case.yaml").write_text(json.dumps(self.case))
            return starred(
                [
                    {"option": option, "resolution": resolution, **self._measure(case, folder / "out", [first, second])}
                    for (option, first), (resolution, second) in product(self.options.items(), self.resolutions.items())
                ]
            )

    def _measure(self, case: Path, out: Path, parts: Sequence[Settings]) -> Row:
        settings: dict[str, Any] = {"output.fields_every": 0, **(self.all or {})}
        for part in parts:
            settings |= part
        summary, seconds = run_timed(case, out, settings)
        errors = {
            f"{check['name']} [%]": 100.0 * abs(check["value"] / check["reference"] - 1.0)
            for check in summary["verify"]
            if check["reference"] and not check["regression"] and self._counts(check["name"])
        }
        return {
            UNKNOWNS: sum(summary["dofs"].values()),
            "steps": summary["steps"]["accepted"],
            TIME: seconds,
            MEMORY: round(summary["memory_mb"]),
            **errors,
            ERROR: max(errors.values()),
        }

    def _counts(self, name: str) -> bool:
        return not self.values or name.split()[0] in self.values


@dataclass(frozen=True)
class Study:
    """Runs that are not made of a case: their rows have an option, a resolution, unknowns, a time and an error."""

    words: str
    measure: Callable[[], list[Row]]

    def run(self) -> list[Row]:
        """All rows; those on the Pareto front have a star."""
        return starred(self.measure())


def starred(rows: list[Row]) -> list[Row]:
    """Rows with a star on those of the front of time and error."""
    on_front = front([(float(row[TIME]), float(row[ERROR])) for row in rows])
    return [{**row, FRONT: "*" if on else ""} for row, on in zip(rows, on_front, strict=True)]


def front(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Pareto's front: the points (cost, error) for which no other point costs no more and errs no more."""
    return [
        not any(other != point and other[0] <= point[0] and other[1] <= point[1] for other in points)
        for point in points
    ]
