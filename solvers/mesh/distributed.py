"""Arrays over the nodes of a distributed mesh, and their form for files, which does not depend on the partition."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.api import Array, State


@dataclass(frozen=True)
class Nodal:
    """Values at the owned nodes of this process: a leaf of a State that `gather` turns into one array."""

    values: Array  #: shape (owned, components)
    nodes: NDArray[np.int64]  #: number of each owned node in the mesh file or a lattice, without gaps


def gather_nodal(comm: MPI.Comm, nodal: Nodal) -> Array | None:
    """All values in the order of the mesh file on rank 0 (None elsewhere), shape (nodes, components)."""
    parts = comm.gather((nodal.nodes, nodal.values), root=0)
    if parts is None:
        return None
    nodes = np.concatenate([n for n, _ in parts])
    values = np.concatenate([v for _, v in parts])
    out = np.empty_like(values)
    out[nodes] = values
    return out


def gather(comm: MPI.Comm, state: State) -> State:
    """The state with every Nodal leaf replaced by the whole array on rank 0 (None on the others). Collective."""
    out: State = {}
    for key, value in state.items():
        if isinstance(value, dict):
            out[key] = gather(comm, value)
        else:
            out[key] = gather_nodal(comm, value) if isinstance(value, Nodal) else value
    return out


def everywhere(comm: MPI.Comm, state: State) -> State:
    """The state with every Nodal leaf replaced by the whole array on all processes. Collective."""
    return dict(comm.bcast(gather(comm, state), root=0))


def scatter(comm: MPI.Comm, state: State, like: State) -> State:
    """The inverse of `gather`: distribute rank 0's arrays as the Nodal leaves of `like`. Collective.

    What `like` lacks, as of contact that began later, is the same on all processes.
    """
    more = comm.bcast({key: value for key, value in state.items() if key not in like}, root=0)
    out: State = dict(more)
    for key, pattern in like.items():
        value = state[key]
        if isinstance(pattern, dict):
            out[key] = scatter(comm, value, pattern)
        elif isinstance(pattern, Nodal):
            out[key] = Nodal(comm.bcast(value, root=0)[pattern.nodes], pattern.nodes)
        else:
            out[key] = comm.bcast(value, root=0)
    return out
