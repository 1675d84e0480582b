"""A value at one instant of an oscillation: it has an error of the phase, which levels around a crest hide."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fsci.running.verify import peak

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TurningPoint:
    """A crest or a trough of a curve."""

    time: float  #: refined by a parabola
    value: float
    sign: float  #: 1: crest, -1: trough


@dataclass(frozen=True)
class Oscillation:
    """The last half period of a curve and its end, at time t."""

    end: float  #: t
    last: TurningPoint
    half_period: float  #: between the last crest and the last trough
    swing: float  #: from one of them to the other
    slope: float  #: df/dt at t
    curvature: float  #: d2f/dt2 at t
    least: float  #: smaller swings do not count

    def change(self, late: float) -> float:
        """|f'| d + |f''| d^2 / 2, how far the curve goes within d of its end; at most the swing."""
        return min(abs(self.slope) * late + 0.5 * abs(self.curvature) * late**2, self.swing)

    def late(self, time: Array | None, curve: Array | None) -> float:
        """By how much another curve is late at t; nan if it has no such crest or trough within half a period.

        It is measured at the last crest or trough. A wrong period makes it grow in proportion to time.
        """
        if time is None or curve is None:
            return math.nan
        near = [turn for turn in turns(time, curve, self.least) if turn.sign == self.last.sign]
        late = min((turn.time - self.last.time for turn in near), key=abs, default=math.nan)
        return late * self.end / self.last.time if abs(late) < self.half_period else math.nan


def oscillation(time: Array | None, curve: Array | None, least: float) -> Oscillation | None:
    """That of a curve which changes by more than `least` from crests to troughs; None of others.

    One that has none within its last period does not swing any more.
    """
    if time is None or curve is None:
        return None
    time, curve = _finite(time, curve)
    found = turns(time, curve, least)
    if len(found) < 2:
        return None
    before, last = found[-2:]
    half_period = last.time - before.time
    if time[-1] - last.time > 2.0 * half_period:
        return None
    slope, curvature = _at_the_end(time, curve)
    return Oscillation(float(time[-1]), last, half_period, abs(last.value - before.value), slope, curvature, least)


def turns(time: Array, curve: Array, least: float) -> list[TurningPoint]:
    """Crests and troughs in turn, between which a curve changes by more than `least`; its two ends are none."""
    time, curve = _finite(time, curve)
    found: list[tuple[int, float]] = []
    best, sign = {1.0: 0, -1.0: 0}, 0.0  # the highest and the lowest sample since the last turn; where the curve goes
    for sample, value in enumerate(curve):
        for way in best:
            if way * value > way * curve[best[way]]:
                best[way] = sample
        for way in (1.0, -1.0):
            if sign != -way and way * (curve[best[way]] - value) > least:
                found.append((best[way], way))
                best, sign = {way: sample, -way: sample}, -way
                break
    return [_refined(time, curve, sample, way) for sample, way in found if 0 < sample < len(curve) - 1]


def _finite(time: Array, curve: Array) -> tuple[Array, Array]:
    finite = np.isfinite(curve)
    return time[finite], curve[finite]


def _refined(time: Array, curve: Array, sample: int, sign: float) -> TurningPoint:
    near = slice(sample - 1, sample + 2)
    when, height = peak(time[near], sign * curve[near])
    return TurningPoint(when, sign * height, sign)


def _at_the_end(time: Array, curve: Array) -> tuple[float, float]:
    """First and second derivative of the parabola through the last three samples."""
    steps = np.diff(time[-3:])
    before, last = np.diff(curve[-3:]) / steps
    curvature = 2.0 * (last - before) / steps.sum()
    return float(last + 0.5 * curvature * steps[1]), float(curvature)
