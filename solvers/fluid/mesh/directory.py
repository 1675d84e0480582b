"""Global dofs of nodes of other processes, found by the numbers of the nodes."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from solvers.api import Indices


class Directory:
    """A table from the number of a node to its global dofs; each process stores a range of numbers."""

    def __init__(self, comm: MPI.Comm, numbers: Indices, dofs: Indices, size: int):
        """numbers: of owned nodes; dofs: their global dofs, (nodes, components); size: count of numbers. Collective."""
        self._comm, self._part = comm, -(-size // comm.size)
        self._dofs = np.full((self._part, dofs.shape[1]), -1, dtype=np.int64)
        keeper = numbers // self._part  # the process that stores each number
        sent = [(numbers[keeper == rank], dofs[keeper == rank]) for rank in range(comm.size)]
        for some, their_dofs in comm.alltoall(sent):
            self._dofs[some - comm.rank * self._part] = their_dofs

    def __call__(self, numbers: Indices) -> Indices:
        """Global dofs of nodes, shape (nodes, components) (collective)."""
        keeper = numbers // self._part
        requests = self._comm.alltoall([numbers[keeper == rank] for rank in range(self._comm.size)])
        answers = self._comm.alltoall([self._dofs[some - self._comm.rank * self._part] for some in requests])
        found = np.empty((len(numbers), self._dofs.shape[1]), dtype=np.int64)
        for rank, answer in enumerate(answers):
            found[keeper == rank] = answer
        return found
