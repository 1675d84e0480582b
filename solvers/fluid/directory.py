"""Dofs of nodes that this process does not hold, found by the nodes' numbers in the box's lattice."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

Numbers = NDArray[np.int64]


class Directory:
    """Global dofs by number of the node; each process keeps those of a part of all numbers."""

    def __init__(self, comm: MPI.Comm, numbers: Numbers, dofs: Numbers, size: int):
        """`numbers` of the owned nodes, their global `dofs` (nodes, components), `size` of the lattice (collective)."""
        self._comm, self._part = comm, -(-size // comm.size)
        self._dofs = np.full((self._part, dofs.shape[1]), -1, dtype=np.int64)
        home = numbers // self._part
        sent = [(numbers[home == rank], dofs[home == rank]) for rank in range(comm.size)]
        for some, their_dofs in comm.alltoall(sent):
            self._dofs[some - comm.rank * self._part] = their_dofs

    def __call__(self, numbers: Numbers) -> Numbers:
        """Global dofs of nodes, shape (nodes, components) (collective)."""
        home = numbers // self._part
        asked = self._comm.alltoall([numbers[home == rank] for rank in range(self._comm.size)])
        answers = self._comm.alltoall([self._dofs[some - self._comm.rank * self._part] for some in asked])
        found = np.empty((len(numbers), self._dofs.shape[1]), dtype=np.int64)
        for rank, answer in enumerate(answers):
            found[home == rank] = answer
        return found
