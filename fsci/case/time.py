"""Section `time`."""

from __future__ import annotations

import sys
from math import floor

from pydantic import model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import Count, CountOrZero, Number, Positive
from fsci.distinct import distinct

#: Share of a step below which what is left at the end is no step of its own: difference formulas over steps of such
#: different lengths divide by the short one.
LEAST_STEP = 0.1


class Retry(Section):
    """The repetition of a failed step as two half steps."""

    halvings: CountOrZero = setting(8, "how many times a step may be halved before the run ends")
    recover_after: Count = setting(5, "accepted steps after which a halved step is doubled again")


class Time(Section):
    """The time interval and its steps; a static case takes its load steps as time steps."""

    start: Number = setting(0.0, "first time", unit="s")
    step: Positive = setting(..., "time step", unit="s")
    end: Number = setting(..., "last time", unit="s")
    retry: Retry = setting(Retry, "repetition of steps that fail")

    @property
    def shared_step(self) -> float:
        """The size [s] of a step that is not halved."""
        return shared(self.end - self.start, self.step)

    @property
    def steps(self) -> int:
        """Steps of the run if none is halved."""
        return number_of_steps(self.end - self.start, self.step)

    @model_validator(mode="after")
    def _ordered(self) -> Time:
        if self.end <= self.start:
            start, end = distinct(self.start, self.end)
            raise fault(f"must be later than 'start', {start}, not {end}", "end")
        if self.step < 1e3 * sys.float_info.epsilon * max(abs(self.start), abs(self.end)):
            raise fault(f"must be larger: at {self.end:g} a step of {self.step:g} is lost in rounding", "step")
        return self


def shared(length: float, step: float) -> float:
    """The step [s] nearest to a given one with which a length [s] has no last step shorter than a tenth of it."""
    count = floor(length / step * (1.0 + 1e-9))
    rest = length - count * step
    return length / count if count and abs(rest) > 1e-9 * step and rest < LEAST_STEP * step else step


def number_of_steps(length: float, step: float) -> int:
    """Steps in a length of time [s] if none is halved."""
    count, rest = divmod(length / shared(length, step), 1.0)
    return int(count) + (rest > 1e-9 * max(count, 1.0))
