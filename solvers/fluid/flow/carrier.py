"""Transfer of the flow to other unknowns, where cells change in the course of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from solvers.api import Array
from solvers.fluid.flow.history import Past
from solvers.fluid.mesh.space import FlowNodes, Unknowns


@dataclass(frozen=True)
class Carrier:
    """Transfers the flow from old unknowns to new ones (collective)."""

    old: Unknowns
    new: Unknowns
    velocity: sparse.csr_matrix  #: of all nodes of the velocity, `FlowNodes.consecutive`, shape (new, old)
    pressure: sparse.csr_matrix
    walls: Array | None = None  #: velocity [m/s] of surfaces beside nodes, shape (new, dim), nan where there is none

    def velocities(self, values: Array) -> Array:
        """Transferred values at local velocity dofs."""
        out = np.zeros(self.new.local)
        return _carry(self.velocity, self.old.velocity, self.new.velocity, values, out, self.new)

    def flow(self, values: Array) -> Array:
        """Transferred values at local dofs of velocity and pressure."""
        out = self.velocities(values)
        return _carry(self.pressure, self.old.pressure, self.new.pressure, values, out, self.new)

    def past(self, past: Past) -> Past:
        """Transferred velocities of an earlier time; found where all velocities exist that a value depends on.

        Fluid between surfaces that have just parted was not there at that time: it has the velocity of these walls.
        """
        unknown = (~past.found & self.old.velocity_mask).astype(float)
        known = np.diff(self.velocity.indptr) > 0
        lost, nodes = np.zeros(self.new.local), self.new.velocity
        found = _carry(abs(self.velocity), self.old.velocity, nodes, unknown, lost, self.new) == 0.0
        found[nodes.dofs] &= known[nodes.consecutive][:, None]
        velocity = self.velocities(past.velocity)
        if self.walls is not None:
            at = ~known[nodes.consecutive] & np.isfinite(self.walls[nodes.consecutive]).all(axis=1)
            velocity[nodes.dofs[at]], found[nodes.dofs[at]] = self.walls[nodes.consecutive[at]], True
        return Past(velocity, found)


def _carry(
    matrix: sparse.csr_matrix, old: FlowNodes, new: FlowNodes, values: Array, out: Array, unknowns: Unknowns
) -> Array:
    everything = np.zeros((matrix.shape[1], old.dofs.shape[1]))
    everything[old.consecutive[: old.owned]] = values[old.dofs[: old.owned]]
    everything = unknowns.grid.comm.allreduce(everything)
    out[new.dofs] = (matrix @ everything)[new.consecutive]
    return out
