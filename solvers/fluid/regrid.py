"""Transfer of a flow to other nested cells before a step, where cells follow bodies.

Where cells are merged, the velocity at the remaining nodes is kept. As a function on the larger cells it does not
fulfil the equation of continuity any more. The pressure would correct that within the next step, and the force on
bodies would show it. So each velocity u of the past is corrected before, by (du, dp) with

    rho alpha (du, v) + ... - (dp, div v) = 0,    (q, div u + div du) + ... = 0    for q at cells that changed,

the tangent of the next step, and 0 on the right-hand side for all other q. The terms of stabilisation in the
equation of continuity have the rate and the pressure in the middle of the last step.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from solvers.fluid.background.carrier import Carrier
from solvers.fluid.background.following import Following, changed_nodes, interpolation
from solvers.fluid.background.nested import Nested
from solvers.fluid.exchanged import ExchangedFlow
from solvers.fluid.time_scheme import FlowStep


def follow_bodies(fluid: ExchangedFlow, following: Following, t: float, dt: float) -> None:
    """Change the cells for a step from t to t + dt [s], if bodies come close to coarse cells in it (collective)."""
    surfaces = {}
    for body, motion in fluid.moved():
        after = motion.x + dt * motion.v if body.motion is None else body.motion(t + dt).x
        surfaces[body.surface.name] = body.surface.facets, (motion.x, after)
    before = fluid.box
    assert isinstance(before, Nested)
    cells = following.cells(before, surfaces)
    if cells is before:
        return
    old, flow, history = fluid.unknowns, fluid.flow, fluid.history
    matrices = [interpolation(before, cells, degree) for degree in (fluid.settings.degree, 1)]
    fluid.box = cells
    fluid.discretise(None)
    carrier = Carrier(old, fluid.unknowns, *matrices)
    fluid.flow[:] = carrier.flow(flow)
    history.pressure_change = carrier.flow(history.pressure_change)
    history.past = [carrier.past(past) for past in history.past]
    _restore_continuity(fluid, changed_nodes(before, cells), t, dt)


def _restore_continuity(fluid: ExchangedFlow, changed: NDArray[np.int64], t: float, dt: float) -> None:
    """Correct the velocities of the past; changed: numbers of the nodes of the pressure whose equations changed."""
    flow, history, mask = fluid.flow.copy(), fluid.history, fluid.unknowns.velocity_mask
    last, earlier = history.past[0], history.past[1 if history.steps else 0]
    rate = (last.velocity - earlier.velocity) / (history.steps[0] if history.steps else dt)
    nodes = fluid.unknowns.pressure
    rows = nodes.dofs[: nodes.owned, 0][np.isin(nodes.numbers[: nodes.owned], changed)]
    step = fluid.current = FlowStep(t, dt, history.difference(dt), history.scale_alpha(dt))
    fluid.prescribe(t)
    fluid.move({body.surface.name: motion for body, motion in fluid.moved() if body.motion is None})
    middle = 0.5 * (last.velocity + earlier.velocity)
    fluid.flow[:] = np.where(mask, middle, flow - 0.5 * history.pressure_change)
    fluid.system.begin_step(step, step.difference.alpha * middle - rate, ~last.found, last.velocity)
    fluid.residual()
    of_changed = np.zeros(fluid.unknowns.owned)
    of_changed[rows] = fluid.residual_rows[rows]
    fluid.residual_rows = of_changed
    of_steps, fluid.linear_solver = fluid.linear_solver, fluid.linear_solver.for_sources()
    try:
        fluid.advance()
    finally:
        fluid.linear_solver = of_steps
    correction = np.where(fluid.system.active_dofs & mask, fluid.flow - middle, 0.0)
    history.past = [replace(past, velocity=past.velocity + correction) for past in history.past]
    fluid.flow[:] = flow + correction
