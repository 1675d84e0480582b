"""Section `time`."""

from __future__ import annotations

import sys

from pydantic import model_validator

from fsci.case.errors import distinct
from fsci.case.section import Section, fault, setting
from fsci.case.values import Count, CountOrZero, Number, Positive


class Retry(Section):
    """The repetition of a failed step as two half steps."""

    halvings: CountOrZero = setting(4, "how many times a step may be halved before the run ends")
    recover_after: Count = setting(5, "accepted steps after which a halved step is doubled again")


class Time(Section):
    """The time interval and its steps; a static case takes its load steps as time steps."""

    start: Number = setting(0.0, "first time", unit="s")
    step: Positive = setting(..., "time step", unit="s")
    end: Number = setting(..., "last time", unit="s")
    retry: Retry = setting(Retry, "repetition of steps that fail")

    @model_validator(mode="after")
    def _ordered(self) -> Time:
        if self.end <= self.start:
            start, end = distinct(self.start, self.end)
            raise fault(f"must be later than 'start', {start}, not {end}", "end")
        if self.step < 1e3 * sys.float_info.epsilon * max(abs(self.start), abs(self.end)):
            raise fault(f"must be larger: at {self.end:g} a step of {self.step:g} is lost in rounding", "step")
        return self
