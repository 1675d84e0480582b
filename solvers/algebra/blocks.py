"""Concatenation of distributed vectors and matrices: each process has its rows of block 0, then of block 1, ..."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.petsc_blocks import join_entries, quick_to_multiply
from solvers.api import Array


class Layout:
    """Offsets of the blocks in the concatenated owned dofs."""

    def __init__(self, comm: MPI.Comm, sizes: Sequence[int]):
        """sizes: counts of owned dofs by block (collective)."""
        self.comm = comm
        self.offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        self.start: int = comm.exscan(self.size) or 0  # type: ignore[attr-defined] #: number of the first owned dof

    @property
    def size(self) -> int:
        """Count of owned dofs of all blocks."""
        return int(self.offsets[-1])

    def among_owned(self, dofs: NDArray[np.int64]) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """(mask of the global dofs that this process owns, their numbers among the owned ones)."""
        mine = (dofs >= self.start) & (dofs < self.start + self.size)
        return mine, dofs[mine] - self.start

    def split(self, array: Array) -> list[Array]:
        """Views of the blocks of a concatenated owned array."""
        return [array[a:b] for a, b in zip(self.offsets[:-1], self.offsets[1:], strict=True)]

    def vector(self) -> PETSc.Vec:
        """A new distributed vector of zeros."""
        return PETSc.Vec().createMPI((self.size, None), comm=self.comm)


def block_diagonal(blocks: Sequence[PETSc.Mat], out: PETSc.Mat | None = None) -> PETSc.Mat:
    """diag(blocks) as one AIJ matrix. A single block is returned without a copy.

    out: the result of an earlier call with the same sparsity pattern, to be overwritten.
    """
    if len(blocks) == 1:
        return blocks[0]
    if out is not None and join_entries(blocks, out):
        return out
    rows = [[block if i == j else None for j in range(len(blocks))] for i, block in enumerate(blocks)]
    nest = PETSc.Mat().createNest(rows, comm=blocks[0].comm)
    if out is None:
        return quick_to_multiply(nest.convert(PETSc.Mat.Type.AIJ, PETSc.Mat()))
    return nest.convert(PETSc.Mat.Type.AIJ, out)


def times(matrix: PETSc.Mat, array: Array) -> Array:
    """Product of a matrix and an array of owned dofs (collective)."""
    x, y = matrix.createVecs()
    x.array[:] = array
    matrix.mult(x, y)
    return y.array
