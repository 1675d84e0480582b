"""How far the values of two runs of a case differ."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from fsci.case import Case
from fsci.case.verify import COUNTERS
from fsci.running.history import History

#: Difference, relative to the largest value of its unit, that rounding explains: solvers stop at the same iterate.
ROUNDING = 1e-8


@dataclass(frozen=True)
class Value:
    """A probe's column, or a number that `verify` looks at.

    `curve` is the column over the time of the run and None of a number; changes are relative to `scale`.
    """

    value: float
    scale: float
    time: Any = None
    curve: Any = None


@dataclass(frozen=True)
class TwinChange:
    """What a twin changes of a value, relative to its scale."""

    value: float  #: of the last one
    curve: float  #: the largest over time


def units(case: Case) -> dict[str, tuple[int, int, int]]:
    """By column of a probe: the powers of length, mass and time in its unit."""
    dimension = case.dimension or 3
    return {
        name: probe.powers(key, name) for key, probe in case.probes.items() for name in probe.columns(key, dimension)
    }


def values(
    history: History,
    summary: Mapping[str, Any],
    unit: Mapping[str, tuple[int, int, int]] = MappingProxyType({}),
    opposite: Collection[str] = (),
) -> dict[str, Value]:
    """All that can be compared of a run: columns of probes, and numbers of `verify` with a reference.

    The scale of a column is the largest number in the columns of its probe, but not less than ROUNDING of the largest
    in columns of its unit: what is smaller is zero. That of a number is its own size. What `verify` compares with zero
    is an error of the method, and no value; nor are COUNTERS. Columns in `opposite` have the other sign.
    """
    columns = [name for name in summary.get("probes", ()) if name in history]
    size = {name: _largest(history[name]) for name in columns}
    found = {}
    for name in columns:
        of_probe = max(size[other] for other in columns if _probe(other) == _probe(name))
        of_unit = max((size[other] for other in columns if name in unit and unit.get(other) == unit[name]), default=0.0)
        curve = history[name] * (-1.0 if name in opposite else 1.0)
        found[name] = Value(float(curve[-1]), max(of_probe, ROUNDING * of_unit), history["time"], curve)
    for check in summary.get("verify", ()):
        column = check["name"].split()[0]
        if check["value"] is not None and check["reference"] != 0.0 and column not in (*columns, *COUNTERS):
            sign = -1.0 if column in opposite else 1.0
            found[check["name"]] = Value(sign * check["value"], abs(check["value"]))
    return found


def changes(base: Mapping[str, Value], twin: Mapping[str, Value]) -> dict[str, TwinChange]:
    """By value; infinite where only one of both has it or is finite, zero where neither is."""
    return {name: _change(value, twin.get(name)) for name, value in base.items()}


def _change(base: Value, twin: Value | None) -> TwinChange:
    if twin is None:
        return TwinChange(math.inf, math.inf)
    last = _relative(twin.value - base.value, base, twin)
    if base.curve is None:
        return TwinChange(last, abs(last))
    inside = (base.time >= twin.time[0]) & (base.time <= twin.time[-1])
    other = np.interp(base.time[inside], twin.time, twin.curve)
    both = np.isfinite(other) & np.isfinite(base.curve[inside])
    difference = np.abs(other - base.curve[inside])[both].max(initial=0.0)
    return TwinChange(last, max(_relative(float(difference), base, twin), abs(last)))


def _relative(difference: float, base: Value, twin: Value) -> float:
    if math.isnan(difference):
        return 0.0 if math.isnan(base.value) and math.isnan(twin.value) else math.inf
    scale = max(base.scale, twin.scale)
    return difference / scale if scale else 0.0


def _probe(column: str) -> str:
    return column.rsplit(".", 1)[0]


def _largest(values: Any) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
