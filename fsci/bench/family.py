"""Run time against error: a case at several resolutions and with several options, measured by its own `verify`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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

    case: str  #: folder in `cases/`
    words: str
    options: Mapping[str, Settings]  #: what is compared: elements, schemes
    resolutions: Mapping[str, Settings]  #: coarse to fine
    values: tuple[str, ...] = ()  #: columns whose errors count; default: all that `verify` has
    all: Settings | None = None

    def run(self) -> list[Row]:
        """A row for each option and resolution; those on the front have a star."""
        with TemporaryDirectory() as folder:
            rows = [
                {"option": option, "resolution": resolution, **self._measure(Path(folder) / "out", [first, second])}
                for (option, first), (resolution, second) in product(self.options.items(), self.resolutions.items())
            ]
        on_front = front([(float(row[TIME]), float(row[ERROR])) for row in rows])
        return [{**row, FRONT: "*" if on else ""} for row, on in zip(rows, on_front, strict=True)]

    def _measure(self, out: Path, parts: Sequence[Settings]) -> Row:
        settings: dict[str, Any] = {"output.fields_every": 0, **(self.all or {})}
        for part in parts:
            settings |= part
        summary, seconds = run_timed(CASES / self.case, out, settings)
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


def front(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Pareto's front: the points (cost, error) for which no other point costs no more and errs no more."""
    return [
        not any(other != point and other[0] <= point[0] and other[1] <= point[1] for other in points)
        for point in points
    ]
