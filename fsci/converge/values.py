"""The values of a run whose errors are estimated: the last of each column of a probe, and what `verify` looks at."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.case import Case, CaseError
from fsci.case.errors import Place, Problem, did_you_mean
from fsci.case.verify import COUNTERS, Check
from fsci.running.history import History
from fsci.running.verify import extremes, window
from fsci.twin.compare import values as twin_values
from fsci.twin.zero import scales

Array = NDArray[np.float64]
#: Statistics that take one sample of a curve.
SAMPLED = ("min", "max", "max_abs")


@dataclass(frozen=True)
class Observed:
    """A value of a run."""

    value: float  #: nan: the run does not have it
    scale: float  #: its size; of a vector's component the largest number in all components over the time of the run
    sampling: float = 0.0  #: what may be between samples of the curve
    time: Array | None = None
    curve: Array | None = None  #: that ends with the value, over `time`


def observed(case: Case, history: History, summary: Mapping[str, Any]) -> dict[str, Observed]:
    """All values of a run.

    What `verify` compares with zero is an error of the method, and no value; nor are COUNTERS. The end of a column is
    one value only.
    """
    found = {
        name: Observed(value.value, value.scale, 0.0, value.time, value.curve)
        for name, value in twin_values(history, {"probes": summary.get("probes", ())}, scales(case)).items()
    }
    for check, result in zip(case.verify, summary.get("verify", ()), strict=True):
        name = result["name"]
        if _is_value(check) and not (check.value in found and name == f"{check.value} final"):
            value = math.nan if result["value"] is None else float(result["value"])
            size = abs(value) if math.isfinite(value) else 0.0
            found[name] = Observed(value, size, _sampling(history, check, value), *_until(history, check))
    return found


def _until(history: History, check: Check) -> tuple[Array, Array] | tuple[()]:
    """The curve whose end is the value."""
    if check.statistic != "final" or check.value not in history:
        return ()
    return window(history["time"], history[check.value], check.start, check.end)


def _sampling(history: History, check: Check, value: float) -> float:
    """How far the extreme of the parabolas through samples is from that of the samples."""
    if check.statistic not in SAMPLED or not math.isfinite(value):
        return 0.0
    time, values = window(history["time"], history[check.value], check.start, check.end)
    if len(time) < 3:
        return 0.0
    low, high = extremes(time, values)
    refined = {"min": low, "max": high, "max_abs": max(abs(low), abs(high))}[check.statistic]
    return abs(refined - value)


@dataclass(frozen=True)
class Distance:
    """How far apart two curves are; the shift is that in time which makes them agree best [s].

    None: no shift takes away half of the sum of squares of their differences, or none that is shorter than the run.
    """

    largest: float
    mean: float
    shift: float | None


def distance(one: Observed, other: Observed) -> Distance | None:
    """Of two curves, at the times of the first one; None without curves of three common times."""
    if one.curve is None or other.curve is None or one.time is None or other.time is None:
        return None
    inside = (one.time >= other.time[0]) & (one.time <= other.time[-1])
    time, curve = one.time[inside], one.curve[inside]
    off = np.interp(time, other.time, other.curve) - curve
    finite = np.isfinite(off)
    time, curve, off = time[finite], curve[finite], off[finite]
    if len(time) < 3:
        return None
    return Distance(float(np.abs(off).max()), float(np.abs(off).mean()), _shift(time, curve, off))


def _shift(time: Array, curve: Array, off: Array) -> float | None:
    """other(t) = one(t - shift), to first order: off = -shift one'."""
    slope = np.gradient(curve, time)
    steep, along, whole = float(slope @ slope), float(slope @ off), float(off @ off)
    # the least squares take away along^2 / steep
    explains = along**2 > 0.5 * steep * whole and abs(along) < steep * (time[-1] - time[0])
    return -along / steep if explains else None


def wanted(case: Case, only: Sequence[str]) -> None:
    """Raises CaseError if a case has nothing to compare, or has no probe of a name."""
    names = list(_names(case))
    if not names:
        message = "the case has neither 'probes' nor 'verify': there is no value whose error could be estimated"
        raise CaseError([Problem(Place(str(case.path), 1, 1), message)])
    for name in only:
        if name in COUNTERS:
            message = f"'{name}' says what the program did: it has no exact value, and no band"
            raise CaseError([Problem(Place("--probe"), message)])
        if name not in names:
            raise CaseError([Problem(Place("--probe"), f"there is no probe '{name}'{did_you_mean(name, names)}")])


def chosen(names: Sequence[str], only: Sequence[str]) -> list[str]:
    """Those of `names` of values that are of a probe, a column or `verify` in `only`; all without any."""
    return [name for name in names if not only or any(one in _parts(name) for one in only)]


def _names(case: Case) -> Iterator[str]:
    dimension = case.dimension or 3
    for name, probe in case.probes.items():
        yield name
        yield from (column for column in probe.columns(name, dimension) if column != name)
    for check in case.verify:
        if _is_value(check):
            yield from _parts(check.value)


def _is_value(check: Check) -> bool:
    return check.reference != 0.0 and check.value not in COUNTERS


def _parts(name: str) -> list[str]:
    """The name of a value, its column, and its probe."""
    column = name.split()[0]
    return list(dict.fromkeys([column.rsplit(".", 1)[0], column, name]))
