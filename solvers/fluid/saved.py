"""The saved state of a flow: what the next step starts from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from solvers.api import State
from solvers.distributed import Nodal, everywhere, scatter
from solvers.fluid.history import History
from solvers.fluid.surface import Motion, together
from solvers.fluid.time_scheme import STEADY, FlowStep

if TYPE_CHECKING:
    from solvers.fluid.field import Fluid


def save(fluid: Fluid) -> State:
    """The state, by nodes [m/s, Pa]; whole arrays where thin bodies may go to other cells (collective)."""
    return everywhere(fluid.comm, _by_process(fluid)) if fluid.thin.may_follow else _by_process(fluid)


def _by_process(fluid: Fluid) -> State:
    unknowns, grid = fluid.unknowns, fluid.grid
    return fluid.history.save(unknowns) | {
        "flow": unknowns.to_nodes(fluid.flow, unknowns.velocity),
        "pressure": unknowns.to_nodes(fluid.flow, unknowns.pressure),
        "pattern": Nodal(fluid.system.pattern_state(), grid.original[: grid.owned]),
        "time": fluid.current.t,
        "thin": fluid.thin.follows,
        "linear_solver": fluid.sequence.position,
        "motion": {body.surface.name: {"x": m.x, "v": m.v} for body, m in fluid.moved()},
    }


def restore(fluid: Fluid, state: State) -> None:
    """Restore a saved state (collective); positions in [m]."""
    motions = {name: Motion(m["x"], m["v"]) for name, m in state["motion"].items()}
    fluid.forget_step()
    fluid.thin.restore(state["thin"])
    facets, motion = together([body.surface for body in fluid.bodies], list(motions.values()), fluid.dim)
    if (sheets := fluid.thin.sheets(facets, motion)) is not fluid.grid.sheets:
        fluid.discretise(sheets)
        fluid.history = History(fluid.settings.time, fluid.unknowns.local)
    if fluid.thin.may_follow:
        state = scatter(fluid.comm, state, _by_process(fluid))
    unknowns = fluid.unknowns
    fluid.history.restore(unknowns, state)
    fluid.flow[:] = unknowns.from_nodes(state["flow"].values, unknowns.velocity)
    fluid.flow[:] += unknowns.from_nodes(state["pressure"].values, unknowns.pressure)
    fluid.current = FlowStep(state["time"], 0.0, STEADY)
    fluid.sequence.position = state["linear_solver"]
    fluid.system.restore_pattern(state["pattern"].values)
    fluid.cutter.begin_step()
    kept = fluid.flow.copy()
    fluid.move(motions)
    fluid.flow[:] = kept
