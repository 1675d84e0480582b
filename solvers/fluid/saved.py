"""The state of a flow that a next step starts from: unknowns, past velocities, cells and sparsity pattern."""

from __future__ import annotations

import numpy as np

from solvers.api import State
from solvers.distributed import Nodal, everywhere, scatter
from solvers.fluid.background.nested import Nested
from solvers.fluid.bodies.surface import Motion, together
from solvers.fluid.exchanged import ExchangedFlow
from solvers.fluid.history import History
from solvers.fluid.time_scheme import STEADY, FlowStep


def saved_state(fluid: ExchangedFlow) -> State:
    """The state; whole arrays where cells may change, by process else (collective)."""
    return everywhere(fluid.comm, _by_process(fluid)) if _cells_may_change(fluid) else _by_process(fluid)


def restore_state(fluid: ExchangedFlow, state: State) -> None:
    """Set what `saved_state` returned (collective)."""
    motions = {name: Motion(m["x"], m["v"]) for name, m in state["motion"].items()}
    fluid.forget_step()
    fluid.thin.restore(state["thin"])
    facets, motion = together([body.surface for body in fluid.bodies], list(motions.values()), fluid.dim)
    if fluid.following is not None:
        nested = fluid.comm.bcast(state["nested"], root=0)
        fluid.box = Nested(fluid.box.edges, np.asarray(nested["first"]), np.asarray(nested["width"]))
    if (sheets := fluid.thin.sheets(facets, motion)) is not fluid.grid.sheets or fluid.following is not None:
        fluid.discretise(sheets)
        fluid.history = History(fluid.settings.time, fluid.unknowns.local)
    if _cells_may_change(fluid):
        state = scatter(fluid.comm, state, _by_process(fluid))
    _set_nodal_state(fluid, state)
    fluid.current = FlowStep(state["time"], 0.0, STEADY)
    fluid.sequence.position = state["linear_solver"]
    fluid.cutter.closed[:] = False
    fluid.cutter.closed[state["closed"]] = True
    fluid.cutter.begin_step()
    flow = fluid.flow.copy()
    fluid.move(motions)
    fluid.flow[:] = flow
    fluid.sweep.restore(state["swept"])
    fluid.system.sweep_velocity = state["sweep_velocity"] if len(state["sweep_velocity"]) else None


def _cells_may_change(fluid: ExchangedFlow) -> bool:
    return fluid.thin.may_follow or fluid.following is not None


def _by_process(fluid: ExchangedFlow) -> State:
    nested = {"first": fluid.box.first, "width": fluid.box.width} if isinstance(fluid.box, Nested) else {}
    return _nodal_state(fluid) | {
        "nested": nested,
        "time": fluid.current.t,
        "thin": fluid.thin.save(),
        "linear_solver": fluid.sequence.position,
        "swept": fluid.sweep.save(),
        "sweep_velocity": np.empty(0) if fluid.system.sweep_velocity is None else fluid.system.sweep_velocity,
        "closed": np.unique(np.concatenate(fluid.comm.allgather(np.flatnonzero(fluid.cutter.closed)))),
        "motion": {body.surface.name: {"x": motion.x, "v": motion.v} for body, motion in fluid.moved()},
    }


def _nodal_state(fluid: ExchangedFlow) -> State:
    """Velocity [m/s], pressure [Pa], past velocities and the sparsity pattern by nodes that this process owns.

    With first-order velocities, the flow in gaps, which is the same on all processes.
    """
    unknowns, grid, system = fluid.unknowns, fluid.grid, fluid.system
    in_gaps = {} if system.gaps is None else {"gaps": system.gaps.memory}
    return (
        fluid.history.save(unknowns)
        | in_gaps
        | {
            "flow": unknowns.to_nodes(fluid.flow, unknowns.velocity),
            "pressure": unknowns.to_nodes(fluid.flow, unknowns.pressure),
            "pattern": Nodal(system.matrix.state(), grid.original[: grid.owned]),
        }
    )


def _set_nodal_state(fluid: ExchangedFlow, state: State) -> None:
    unknowns, system = fluid.unknowns, fluid.system
    fluid.history.restore(unknowns, state)
    fluid.flow[:] = unknowns.from_nodes(state["flow"].values, unknowns.velocity)
    fluid.flow[:] += unknowns.from_nodes(state["pressure"].values, unknowns.pressure)
    system.matrix.restore(state["pattern"].values)
    if system.gaps is not None:
        system.gaps.memory = state["gaps"]
