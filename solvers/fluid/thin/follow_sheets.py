"""Transfer of a flow to other cells of the fluid around thin bodies, at an iterate within a step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.fluid.bodies.reach import moved_too_far
from solvers.fluid.bodies.surface import Motion
from solvers.fluid.exchanged import ExchangedFlow
from solvers.fluid.thin.sheet_parts import AROUND
from solvers.fluid.thin.sheets import Sheets
from solvers.fluid.thin.thin_bodies import Carrying


def follow_sheets(fluid: ExchangedFlow, sheets: Sheets | None, facets: NDArray[np.int64], motion: Motion) -> None:
    """Set the sheets that belong to the present facets (collective).

    If they have other unknowns, the iterate is carried over from the last iterate, and the history from the state at
    the beginning of the step, so that it does not depend on the iterates in between. Raises StepFailed if a body has
    moved too far in a step of an unsteady flow.
    """
    if sheets is fluid.grid.sheets:
        return
    assert sheets is not None
    began = fluid.began
    if began is not None and not fluid.settings.steady:  # a steady flow has no history
        if began.way(motion.x) > AROUND * fluid.smallest_cell:
            raise moved_too_far(fluid, AROUND)
    now, old, flow = fluid.grid.sheets, fluid.unknowns, fluid.flow
    before, increment = fluid.before, fluid.increment
    if now is not None and now.same_unknowns(sheets):
        fluid.grid.sheets = sheets
        return
    fluid.discretise(sheets)
    carry = Carrying(fluid.unknowns, facets, motion)
    carrier = carry(old, now)
    fluid.flow[:] = carrier.flow(flow)
    fluid.before, fluid.increment = (
        carrier.flow(np.pad(values, (0, old.local - old.owned)))[: fluid.unknowns.owned]
        for values in (before, increment)
    )
    if began is not None and began.unknowns is not old:
        carrier = carry(began.unknowns, began.sheets)
    history = fluid.history
    history.past = [carrier.past(past) for past in (history.past if began is None else began.past)]
    history.forget_pressure(fluid.unknowns.local)
    if began is not None:
        fluid.begin_system(began.step)
        fluid.prescribe(fluid.prescribed_at)
