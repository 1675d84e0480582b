"""Section `output`."""

from __future__ import annotations

from typing import Literal

from fsci.case.section import Section, setting
from fsci.case.values import Count, CountOrZero


class Output(Section):
    """Intervals of the output of fields and checkpoints."""

    fields_every: CountOrZero = setting(
        1, "steps between two states written for ParaView; 0 writes only the first and the last"
    )
    format: Literal["vtu", "vtkhdf"] = setting(
        "vtu", "of the fields: a file for each body and time, or `vtkhdf`, one file for all (ParaView 5.13, VTK 9.4)"
    )
    checkpoint_every: CountOrZero = setting(0, "steps between two checkpoints; 0 writes only the last")
    residuals: tuple[Count, ...] = setting(tuple, "numbers of the steps whose Newton residuals summary.json keeps")
