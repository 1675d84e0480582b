"""Coarse matrices of multigrid, C = P^T A P, where rows of P without fluid are empty.

Most matrices of flows consist of dense blocks, one per pair of nodes, and all unknowns of a node have the same weights.
C then follows block by block (`kernels.coarse_product`), in a fifth of the time that PETSc takes for it row by row.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from solvers import kernels
from solvers.api import Array
from solvers.petsc_blocks import BlockRows, block_rows


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
        blocks = block_rows(fine)
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
    """A coarse matrix of dense blocks, on one process."""

    def __init__(self, interpolation: PETSc.Mat, fine: BlockRows):
        self._size = size = fine.values.shape[1]
        start, columns, weights = interpolation.getValuesCSR()
        some = np.repeat(np.arange(len(start) - 1) % size == 0, np.diff(start))  # the first unknown of each node
        self._P = (start[::size] // size).astype(np.int32), columns[some] // size
        self._weights = weights[some]
        self._pattern = kernels.coarse_pattern(fine.start, fine.columns, *self._P, interpolation.size[1] // size)
        self._values = np.zeros((len(self._pattern[1]), size, size))
        matrix = PETSc.Mat().createBAIJ(
            (interpolation.size[1],) * 2, size, nnz=np.diff(self._pattern[0]), comm=interpolation.comm
        )
        self._set(matrix)
        # its copy multiplies by BLAS, see `FlowSystem`
        self._matrix = matrix.duplicate(copy=True)
        self._matrix.setOption(PETSc.Mat.Option.ROW_ORIENTED, False)

    def update(self, fine: BlockRows, free: Array) -> PETSc.Mat:
        self._values[:] = 0.0
        kernels.coarse_product(
            fine.start, fine.columns, fine.values, *self._P, self._weights, free, *self._pattern, self._values
        )
        self._set(self._matrix)
        return self._matrix

    def _set(self, matrix: PETSc.Mat) -> None:
        matrix.setValuesBlockedCSR(*self._pattern, self._values)
        matrix.assemble()
