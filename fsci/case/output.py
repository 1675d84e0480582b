"""Section `output`."""

from __future__ import annotations

from fsci.case.section import Section, setting
from fsci.case.values import Count, CountOrZero


class Output(Section):
    """Intervals of the output of fields and checkpoints."""

    fields_every: CountOrZero = setting(
        1, "steps between two states written for ParaView; 0 writes only the first and the last"
    )
    checkpoint_every: CountOrZero = setting(0, "steps between two checkpoints; 0 writes only the last")
    residuals: tuple[Count, ...] = setting(tuple, "numbers of the steps whose Newton residuals summary.json keeps")
