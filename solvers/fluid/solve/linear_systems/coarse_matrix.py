"""Coarse matrices of multigrid, C = P^T A P, where rows of P without fluid are empty.

Most matrices of flows consist of dense blocks, one per pair of nodes, and all unknowns of a node have the same weights.
C then follows block by block (`kernels.coarse_product`), in a fifth of the time that PETSc takes for it row by row.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import kernels
from solvers.algebra.petsc_blocks import SharedBlockRows, shared_block_rows
from solvers.api import Array
from solvers.fluid.terms.matrix import quick_copy


class CoarseMatrix:
    """That of one level, for matrices of the next finer level that share a pattern; each overwrites the last one."""

    def __init__(self, interpolation: PETSc.Mat):
        """interpolation: as if all unknowns were free."""
        self._everywhere = interpolation
        self._P = interpolation.copy()
        self._coarse, self._fine = interpolation.createVecs()
        self.free = np.ones(0)  #: 1 for owned coarse unknowns that some free finer one depends on, else 0
        self._converted: PETSc.Mat | None = None
        self._matrix: PETSc.Mat | None = None
        self._blocks: _Blocks | None = None

    def mark(self, free: Array) -> PETSc.Mat:
        """P for owned finer unknowns with 1 where they are free, else 0 (collective)."""
        self._everywhere.copy(self._P, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        self._fine.array[:] = free
        self._P.diagonalScale(self._fine, None)
        self._P.multTranspose(self._fine, self._coarse)
        self.free = (self._coarse.array > 0.0).astype(float)
        return self._P

    def update(self, fine: PETSc.Mat, free: Array) -> PETSc.Mat:
        """C with rows of the identity for coarse unknowns that correct nothing (collective)."""
        blocks = shared_block_rows(fine)
        if blocks is None:
            matrix = self._by_rows(fine)
        else:
            self._blocks = self._blocks or _Blocks(self._everywhere, blocks)
            matrix = self._blocks.update(blocks, free)
        self._coarse.array[:] = 1.0 - self.free
        matrix.setDiagonal(self._coarse, addv=PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()
        return matrix

    def _by_rows(self, fine: PETSc.Mat) -> PETSc.Mat:
        if "baij" in fine.getType():
            fine = self._converted = fine.convert(PETSc.Mat.Type.AIJ, self._converted or PETSc.Mat())
        self._matrix = fine.ptap(self._P, result=self._matrix)
        return self._matrix


class _Blocks:
    """A coarse matrix of dense blocks.

    A process computes the products of its rows of A, for which it has the rows of P of its columns. They belong to rows
    of C of other processes, too, to which PETSc adds them.
    """

    def __init__(self, interpolation: PETSc.Mat, fine: SharedBlockRows):
        size = fine.own.values.shape[1]
        self._free = interpolation.createVecLeft()
        of_ghosts = PETSc.IS().createBlock(size, fine.ghosts, comm=PETSc.COMM_SELF)
        self._ghost_free = PETSc.Vec().createSeq(size * len(fine.ghosts), comm=PETSc.COMM_SELF)
        self._scatter = PETSc.Scatter().create(self._free, of_ghosts, self._ghost_free, None)
        every = _node_table(interpolation, size)
        if interpolation.comm.size > 1:
            rows = PETSc.IS().createGeneral(size * fine.ghosts, comm=PETSc.COMM_SELF)
            columns = PETSc.IS().createStride(interpolation.size[1], 0, 1, comm=PETSc.COMM_SELF)
            every = _below(every, _node_table(interpolation.createSubMatrices([rows], [columns])[0], 1, size))
        start, columns, self._weights = every
        nodes, columns = np.unique(columns, return_inverse=True)
        self._P, self._nodes = (start, columns.astype(np.int32)), nodes.astype(PETSc.IntType)
        self._ghost_columns = fine.others.columns + np.int32(len(fine.own.start) - 1)
        pattern = _joined(fine, self._ghost_columns)
        self._pattern = start, columns = kernels.coarse_pattern(*pattern, *self._P, len(nodes))
        self._entries = start, self._nodes[columns]
        self._values = np.zeros((len(columns), size, size))
        most = int(interpolation.comm.tompi4py().allreduce(np.diff(start).max(initial=1), op=MPI.MAX))
        own = interpolation.getLocalSize()[1]
        matrix = PETSc.Mat().createBAIJ(
            ((own, None), (own, None)), size, nnz=most if interpolation.comm.size == 1 else (most, most),
            comm=interpolation.comm,
        )  # fmt: skip
        matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)  # rows at the boundary of a process
        self._add(matrix)
        self._matrix = quick_copy(matrix)
        self._matrix.setOption(PETSc.Mat.Option.ROW_ORIENTED, False)

    def update(self, fine: SharedBlockRows, free: Array) -> PETSc.Mat:
        self._free.array[:] = free
        self._scatter.scatter(self._free, self._ghost_free)
        marks = np.concatenate([free, self._ghost_free.array_r])
        self._values[:] = 0.0
        for part, columns in ((fine.own, fine.own.columns), (fine.others, self._ghost_columns)):
            kernels.coarse_product(
                part.start, columns, part.values, *self._P, self._weights, marks, *self._pattern, self._values
            )
        self._matrix.zeroEntries()
        self._add(self._matrix)
        return self._matrix

    def _add(self, matrix: PETSc.Mat) -> None:
        matrix.setValuesBlockedIJV(*self._entries, self._values, PETSc.InsertMode.ADD_VALUES, self._nodes)
        matrix.assemble()


Table: TypeAlias = tuple[NDArray[np.int32], NDArray[np.int32], Array]


def _node_table(interpolation: PETSc.Mat, step: int, size: int | None = None) -> Table:
    """Rows (starts, columns, weights) of the first unknown of each node, the first of every `step` rows of P.

    Columns are nodes of `size` unknowns, as many as `step` by default.
    """
    start, columns, weights = interpolation.getValuesCSR()
    some = np.repeat(np.arange(len(start) - 1) % step == 0, np.diff(start))
    counts = np.diff(start)[::step]
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    return starts, columns[some] // (size or step), weights[some]


def _below(first: Table, second: Table) -> Table:
    """The rows of the first table, then those of the second."""
    starts = np.concatenate([first[0], first[0][-1] + second[0][1:]])
    return starts, np.concatenate([first[1], second[1]]), np.concatenate([first[2], second[2]])


def _joined(fine: SharedBlockRows, ghost_columns: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Which blocks there are in rows of this process, by compressed rows."""
    counts = [np.diff(part.start) for part in (fine.own, fine.others)]
    rows = np.concatenate([np.repeat(np.arange(len(count)), count) for count in counts])
    columns = np.concatenate([fine.own.columns, ghost_columns])
    start = np.concatenate([[0], np.cumsum(counts[0] + counts[1])]).astype(np.int32)
    return start, columns[np.argsort(rows, kind="stable")]
