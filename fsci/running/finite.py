"""Columns of the history that are not numbers, though no place without fluid or contact explains it."""

from __future__ import annotations

import math
from collections.abc import Mapping

from fsci.case import Case
from solvers.api import Finding


def not_numbers(case: Case, numbers: Mapping[str, float]) -> list[Finding]:
    """A finding for each value that is nan or infinite.

    These may be nan: probes of a pair, before it touches or where nothing is near; the flow at a point or in a
    box and the pressure on a patch, while a body covers them; the volume of a pocket that has opened.
    """
    bad = [name for name, value in numbers.items() if not math.isfinite(value)]
    return [
        _finding(name, numbers[name]) for name in bad if not (math.isnan(numbers[name]) and _may_be_nan(case, name))
    ]


def _may_be_nan(case: Case, column: str) -> bool:
    probe = case.probes.get(column.partition(".")[0])
    if probe is None:
        return column.startswith("fluid.pocket_")
    in_flow = probe.field == "fluid" and (probe.place in ("at", "box") or probe.quantity == "pressure")
    return probe.pair is not None or in_flow


def _finding(column: str, value: float) -> Finding:
    what = "not a number" if math.isnan(value) else "infinite"
    return Finding(
        "nan", column, value, f"the column '{column}' of history.csv is {what}: look at what it is computed from"
    )
