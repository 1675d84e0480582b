"""Periodic directions: cells at the end of the box get the unknowns of the nodes at its beginning.

Nothing that is assembled by cells needs to know of the period then. The unknowns that no cell has any more stay, like
those inside of bodies, without a part in the equations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array

Mask = NDArray[np.bool_]

#: More nodes than any lattice has: keeps the numbers of several components apart.
FAR = 2**48


@dataclass(frozen=True)
class LatticeNodes:
    """Nodes of velocity or pressure; local ones."""

    dofs: NDArray[np.int32]  #: shape (n, components)
    points: Array  #: positions [m], shape (n, dim); of a node at the end those of its twin
    numbers: NDArray[np.int64]  #: in the lattice; a node at the end has that of its twin
    at_start: Mask  #: on the first plane of a periodic direction
    at_end: Mask  #: on the last one


def join_ends(comm: MPI.Comm, space: Any, parts: list[LatticeNodes]) -> tuple[Any, list[LatticeNodes]]:
    """(the space in which nodes at the end are their twins, its nodes) (collective)."""
    size = int(space.dofmap.index_map_bs)
    start, end = space.dofmap.index_map.local_range
    # a block has the unknowns of all components
    columns = [(parts[0], 0)] if size > 1 else [(part, i) for part in parts for i in range(part.dofs.shape[1])]
    keys = np.concatenate([index * FAR + part.numbers for index, (part, _) in enumerate(columns)])
    blocks = np.concatenate([part.dofs[:, i] // size for part, i in columns])
    at_start, at_end = (np.concatenate([getattr(part, name) for part, _ in columns]) for name in ("at_start", "at_end"))
    mine = at_start & ~at_end & (blocks < end - start)
    tables = comm.allgather((keys[mine], start + blocks[mine].astype(np.int64)))
    owners = np.repeat(np.arange(comm.size, dtype=np.int32), [len(known) for known, _ in tables])
    known, masters = (np.concatenate(column) for column in zip(*tables, strict=True))
    order = np.argsort(known)
    twin = order[np.searchsorted(known[order], keys[at_end])]
    space, local = fem.identify_blocks(space, blocks[at_end], masters[twin], owners[twin])
    joined = np.arange(blocks.max(initial=-1) + 1, dtype=np.int32)
    joined[blocks[at_end]] = local
    return space, [replace(part, dofs=size * joined[part.dofs // size] + part.dofs % size) for part in parts]
