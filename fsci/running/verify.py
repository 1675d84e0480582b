"""The `verify:` block of a case: statistics of history columns against reference values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.case.verify import Check

Array = NDArray[np.float64]


def evaluate(history: Mapping[str, Array], checks: Sequence[Check]) -> list[dict[str, Any]]:
    """One dict {name, value, reference, tolerance, ok, regression, message} per check.

    `tolerance` is the difference allowed between value and reference; `message` says why there is no value;
    `regression` marks a reference that is the result of an earlier version.
    """
    return [evaluate_one(history, check) for check in checks]


def evaluate_one(history: Mapping[str, Array], check: Check) -> dict[str, Any]:
    """The result of one check; see evaluate."""
    value, message = math.nan, ""
    if check.value not in history:
        message = f"'{check.value}' is not in the history"
    else:
        time, values = window(history["time"], history[check.value], check.start, check.end)
        if len(time) == 0:
            message = "no step in the time window"
        elif check.statistic == "final" and not np.isfinite(values[-1]):
            message = f"'{check.value}' is not finite at the end"
        elif check.statistic != "final" and not np.all(np.isfinite(values)):
            message = f"'{check.value}' is not finite everywhere"
        else:
            value = STATISTICS[check.statistic](time, values)
            if math.isnan(value):
                message = "less than one full period in the time window"
    relative = (check.relative or 0.0) * abs(check.reference)
    tolerance = relative if check.absolute is None else check.absolute
    since = "" if check.start is None else f" from {check.start:g}"
    until = "" if check.end is None else f" to {check.end:g}"
    return {
        "name": f"{check.value} {check.statistic}{since}{until}",
        "value": value,
        "reference": check.reference,
        "tolerance": tolerance,
        "ok": bool(abs(value - check.reference) <= tolerance),
        "regression": check.regression,
        "message": message,
    }


def window(time: Array, values: Array, start: float | None, end: float | None = None) -> tuple[Array, Array]:
    """The samples from `start` to `end`; a sample that misses them by rounding belongs to them."""
    if len(time) == 0:
        return time, values
    first, last = time[0] if start is None else start, time[-1] if end is None else end
    rounding = 1e-9 * max(abs(first), abs(time[-1]))
    inside = (time >= first - rounding) & (time <= last + rounding)
    return time[inside], values[inside]


def peak(time: Array, values: Array) -> tuple[float, float]:
    """(time, value) of the maximum of a sampled signal, the first one; interior ones are refined by a parabola.

    With the slopes s1, s2 left and right of the middle sample and the steps h1, h2 the parabola about it is
    y = y1 + b t + c t^2 with c = (s2 - s1)/(h1 + h2), b = s1 + c h1; its top is y1 - b^2/(4c) at t = -b/(2c).
    """
    steps, slopes = np.diff(time), np.diff(values) / np.diff(time)
    tops = np.flatnonzero((slopes[:-1] >= 0) & (slopes[1:] <= 0) & (slopes[:-1] > slopes[1:]))
    s1, s2, h1, h2 = slopes[:-1][tops], slopes[1:][tops], steps[:-1][tops], steps[1:][tops]
    c = (s2 - s1) / (h1 + h2)
    b = s1 + c * h1
    times = np.concatenate([time, time[1:-1][tops] - b / (2 * c)])
    heights = np.concatenate([values, values[1:-1][tops] - b**2 / (4 * c)])
    first = int(heights.argmax())
    return float(times[first]), float(heights[first])


def highest(time: Array, values: Array) -> float:
    """The maximum of a sampled signal; see `peak`."""
    return peak(time, values)[1]


def extremes(time: Array, values: Array) -> tuple[float, float]:
    """Refined (minimum, maximum) of a sampled signal."""
    return -highest(time, -values), highest(time, values)


def mean(time: Array, values: Array) -> float:
    """(max + min)/2, as Turek and Hron define it."""
    low, high = extremes(time, values)
    return (high + low) / 2


def amplitude(time: Array, values: Array) -> float:
    """(max - min)/2, as Turek and Hron define it."""
    low, high = extremes(time, values)
    return (high - low) / 2


def frequency(time: Array, values: Array) -> float:
    """Whole periods over the time they take, from crossings of the mean level; NaN with less than one period.

    A crossing counts when the signal passes the whole band of a tenth of the amplitude around the mean, so
    that ripples do not. Rising and falling crossings are counted apart: an error of the level cancels.
    """
    low, high = extremes(time, values)
    if not high > low:
        return math.nan
    signal = (values - (high + low) / 2) / ((high - low) / 2)
    outside = np.flatnonzero(np.abs(signal) > 0.1)
    turns = np.flatnonzero(np.diff(np.sign(signal[outside])))
    periods, duration = 0, 0.0
    for sign in (1.0, -1.0):
        times = [
            crossing(time, sign * signal, int(outside[turn])) for turn in turns if sign * signal[outside[turn]] < 0
        ]
        if len(times) > 1:
            periods, duration = periods + len(times) - 1, duration + times[-1] - times[0]
    return periods / duration if periods else math.nan


def crossing(time: Array, signal: Array, first: int) -> float:
    """The time of the first rise through zero after sample `first`, on the cubic through four samples."""
    from scipy.interpolate import BarycentricInterpolator
    from scipy.optimize import brentq

    left = first + int(np.flatnonzero(signal[first + 1 :] >= 0)[0])
    near = slice(max(left - 1, 0), left + 3)
    cubic = BarycentricInterpolator(time[near], signal[near])
    return float(brentq(cubic, time[left], time[left + 1], xtol=1e-12 * (time[left + 1] - time[left])))


STATISTICS = {
    "final": lambda time, values: float(values[-1]),
    "min": lambda time, values: float(values.min()),
    "max": lambda time, values: float(values.max()),
    "max_abs": lambda time, values: float(np.abs(values).max()),
    "time_of_max": lambda time, values: peak(time, values)[0],
    "mean": mean,
    "amplitude": amplitude,
    "frequency": frequency,
}
