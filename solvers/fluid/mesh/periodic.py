"""Periodic directions: cells at the end of the box have the unknowns of the nodes at its beginning.

Hence assembly does not need to treat periods. The nodes at the end have no unknowns of their own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array, Mask

#: More nodes than any lattice has: keeps the numbers of several components apart.
BEYOND_NODES = 2**48


@dataclass(frozen=True)
class LatticeNodes:
    """Local nodes of velocity or pressure, with their numbers in a lattice."""

    dofs: NDArray[np.int32]  #: shape (n, components)
    points: Array  #: positions [m], shape (n, dim); of a node at the end those of its twin
    numbers: NDArray[np.int64]  #: in the lattice; a node at the end has that of its twin
    at_start: Mask  #: on the first plane of a periodic direction
    at_end: Mask  #: on the last one


def join_ends(comm: MPI.Comm, space: Any, parts: list[LatticeNodes]) -> tuple[Any, list[LatticeNodes]]:
    """Identify nodes at the end of periods with those at the beginning; (the new space, its nodes) (collective)."""
    size = int(space.dofmap.index_map_bs)
    start, end = space.dofmap.index_map.local_range
    # a block has the unknowns of all components
    columns = [(parts[0], 0)] if size > 1 else [(part, i) for part in parts for i in range(part.dofs.shape[1])]
    keys = np.concatenate([index * BEYOND_NODES + part.numbers for index, (part, _) in enumerate(columns)])
    blocks = np.concatenate([part.dofs[:, i] // size for part, i in columns])
    at_start, at_end = (np.concatenate([getattr(part, name) for part, _ in columns]) for name in ("at_start", "at_end"))
    mine = at_start & ~at_end & (blocks < end - start)
    tables = comm.allgather((keys[mine], start + blocks[mine].astype(np.int64)))
    owners = np.repeat(np.arange(comm.size, dtype=np.int32), [len(at_starts) for at_starts, _ in tables])
    start_keys, masters = (np.concatenate(column) for column in zip(*tables, strict=True))
    order = np.argsort(start_keys)
    twin = order[np.searchsorted(start_keys[order], keys[at_end])]
    space, joined = fem.identify_blocks(space, blocks[at_end], masters[twin], owners[twin])
    return space, [replace(part, dofs=size * joined[part.dofs // size] + part.dofs % size) for part in parts]
