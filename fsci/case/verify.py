"""Section `verify`."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import NotNegative, Number, Switch, Text
from fsci.distinct import distinct

#: columns of history.csv that every run has
RUN_COLUMNS = ("iterations", "residual")

#: errors of the balances of the fields: energy of the structure, volume of the fluid
FIELD_COLUMNS = {"structure": "structure.energy", "fluid": "fluid.mass"}

#: volume that passes through the surfaces of bodies in a fluid
BODY_COLUMN = "fluid.leak"
#: and through closed contact that seeps
SEEPAGE_COLUMN = "fluid.seepage"

#: those of the interface between both
COUPLING_COLUMNS = ("interface.force", "interface.momentum", "interface.power", "interface.work", "fluid.loss")

#: and those of a run with contact, besides the resultants contact.PAIR.x, .y, .z on the slave
CONTACT_COLUMNS = ("contact.active", "contact.changes")
FRICTION_COLUMNS = ("contact.sticking", "contact.friction")

#: columns that say what the program did: they have no exact value
COUNTERS = (*RUN_COLUMNS, *CONTACT_COLUMNS, "contact.sticking")


class Check(Section):
    """A reference value for a result of the run; exactly one of `relative` and `absolute` is its tolerance.

    With the largest and smallest value M and m in the window, mean is (M + m)/2, amplitude (M - m)/2 and max_abs the
    larger of |M| and |m|. M is reached at `time_of_max` [s]. All values in the window must be finite, for `final` only
    the last one: the time of the first contact is nan before.
    """

    value: Text = setting(
        ..., "column of history.csv: of a probe such as A.y, iterations, residual, structure.energy or fluid.mass"
    )
    statistic: Literal["final", "min", "max", "max_abs", "time_of_max", "mean", "amplitude", "frequency"] = setting(
        "final", "how one number is computed from the values of the column"
    )
    start: Number | None = setting(
        None, "start of the time window; default: the start of the run", unit="s", name="from"
    )
    end: Number | None = setting(None, "end of the time window; default: the end of the run", unit="s", name="to")
    reference: Number = setting(..., "the value to reach")
    relative: NotNegative | None = setting(None, "allowed deviation, relative to the reference", unit="1")
    absolute: NotNegative | None = setting(None, "allowed deviation, in the unit of the value")
    regression: Switch = setting(
        False,
        "the reference is a result of an earlier version, not a published or exact value",
    )

    @model_validator(mode="after")
    def _one_tolerance(self) -> Check:
        if self.relative is not None and self.absolute is not None:
            raise fault("give either 'relative' or 'absolute', not both", "absolute")
        if self.start is not None and self.end is not None and self.end < self.start:
            start, end = distinct(self.start, self.end)
            raise fault(f"must not be before 'from', {start}, not {end}", "to")
        if self.relative is None and self.absolute is None:
            raise fault("a check needs a tolerance: 'relative' or 'absolute'")
        if self.relative is not None and self.reference == 0:
            raise fault("a reference of 0 needs an 'absolute' tolerance", "relative")
        return self
