"""The cut of a flow's grid by the surfaces of bodies at their present positions, at each iterate of a step."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.fluid.bodies.all_surfaces import AllSurfaces
from solvers.fluid.bodies.reach import require_finest, require_history, require_within_period, strip_layers
from solvers.fluid.bodies.surface import Motion
from solvers.fluid.cutting.cut import Cut
from solvers.fluid.cutting.pressure_level import PressureLevels
from solvers.fluid.exchanged import ExchangedFlow
from solvers.fluid.steady_iteration import SteadyIteration
from solvers.fluid.thin.follow_sheets import follow_sheets
from solvers.timing import Timer


class FlowAroundSurfaces(ExchangedFlow, Protocol):
    """A flow whose grid is cut by surfaces that may move; `Fluid` is one."""

    timer: Timer
    surfaces: AllSurfaces
    levels: PressureLevels
    held: NDArray[np.bool_]
    steady_iteration: SteadyIteration


def follow_surfaces(fluid: FlowAroundSurfaces, *, with_solid: bool) -> None:
    """Cut the grid by the surfaces with their present motions, and set all that depends on the cut (collective).

    with_solid: see `Fluid.move`. Raises StepFailed if surfaces have moved too far in this step, or are close to coarse
    cells or to periodic faces.
    """
    with fluid.timer("cut"):
        cut = _cut(fluid)
    with fluid.timer("weights"):
        fluid.system.set_cut(cut)
        fluid.system.sweep_velocity = fluid.sweep.velocity(
            cut.facets, cut.motion.x, cut.motion.v, fluid.current.difference
        )
        require_history(fluid, cut, fluid.history.missing(fluid.current.difference))
        require_within_period(fluid.unknowns, cut)
        fluid.flow[~fluid.system.active_dofs] = 0.0
        if fluid.unknowns.hanging is not None:
            fluid.unknowns.share(fluid.system.flow)
        fluid.held = fluid.system.held()
        fluid.levels.hold(fluid.held, set_by_solids=with_solid and not fluid.settings.steady)


def _cut(fluid: FlowAroundSurfaces) -> Cut:
    fluid.surfaces.follow(fluid.motions)
    facets, motion = fluid.surfaces.together(fluid.motions)
    follow_sheets(fluid, fluid.thin.sheets(facets, motion), facets, motion)
    if fluid.settings.steady and fluid.steady_iteration.scales_follow:
        # roots belong to the final position of the bodies, not to the initial one
        fluid.cutter.forget()
        fluid.system.forget_roots()
    unions = fluid.cutter.unions or fluid.grid.sheets is not None
    wet = fluid.surfaces.wet_in_unions if unions else fluid.surfaces.wet
    cut = fluid.cutter(facets, motion, _layers(fluid, motion), wet)
    require_finest(fluid.cutter, fluid.comm)
    return cut


def _layers(fluid: FlowAroundSurfaces, motion: Motion) -> int:
    """Number of cell layers behind the surface that the next steps may uncover; none around thin bodies."""
    if fluid.thin.follows or fluid.settings.steady or all(body.rests for body in fluid.bodies):
        return 0
    times = fluid.settings.time.times
    return strip_layers(fluid.grid, motion, times * fluid.current.dt, fluid.smallest_cell)
