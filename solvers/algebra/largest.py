"""The position of the largest value of a distributed quantity, for messages."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from solvers.api import Array


def position_of_largest(comm: MPI.Comm, sizes: Array, points: Array) -> tuple[float, ...]:
    """Position [m] of the node with the largest value; NaN counts as infinite (collective).

    sizes: at the nodes of this process, shape (n,); points: their positions, shape (n, dim).
    """
    sizes = np.nan_to_num(sizes, nan=np.inf)
    index = int(np.argmax(sizes)) if len(sizes) else 0
    largest = float(sizes[index]) if len(sizes) else -1.0
    _, rank = comm.allreduce((largest, comm.rank), op=MPI.MAXLOC)
    place = tuple(float(c) for c in points[index]) if rank == comm.rank else None
    found: tuple[float, ...] = comm.bcast(place, root=rank)
    return found
