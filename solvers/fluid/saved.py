"""The saved state of a flow by nodes: unknowns, past velocities and sparsity pattern."""

from __future__ import annotations

from solvers.api import State
from solvers.distributed import Nodal
from solvers.fluid.background.grid import DistributedGrid
from solvers.fluid.background.space import Unknowns
from solvers.fluid.history import History
from solvers.fluid.system import FlowSystem


def nodal_state(unknowns: Unknowns, grid: DistributedGrid, history: History, system: FlowSystem) -> State:
    """Velocity [m/s], pressure [Pa], past velocities and the sparsity pattern by nodes that this process owns.

    With first-order velocities, the flow in gaps, which is the same on all processes.
    """
    flow = system.flow.x.array
    in_gaps = {} if system.gaps is None else {"gaps": system.gaps.memory}
    return (
        history.save(unknowns)
        | in_gaps
        | {
            "flow": unknowns.to_nodes(flow, unknowns.velocity),
            "pressure": unknowns.to_nodes(flow, unknowns.pressure),
            "pattern": Nodal(system.pattern_state(), grid.original[: grid.owned]),
        }
    )


def set_nodal_state(state: State, unknowns: Unknowns, history: History, system: FlowSystem) -> None:
    """Set what `nodal_state` returned."""
    flow = system.flow.x.array
    history.restore(unknowns, state)
    flow[:] = unknowns.from_nodes(state["flow"].values, unknowns.velocity)
    flow[:] += unknowns.from_nodes(state["pressure"].values, unknowns.pressure)
    system.restore_pattern(state["pattern"].values)
    if system.gaps is not None:
        system.gaps.memory = state["gaps"]
