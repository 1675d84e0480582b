"""Assembly of a tangent by blocks of nodes: PETSc adds them three times as fast as single entries."""

from __future__ import annotations

from typing import Any

import numpy as np
from petsc4py import PETSc

from solvers import fem
from solvers.algebra.petsc_blocks import BlockRows, block_rows, has_entries_of, write_entries


class BlockAssembly:
    """Assembles a bilinear form of vectors into matrices of its pattern.

    On one process it does so by blocks from the second time on. The entries are the same bit for bit, and the blocks
    take as much memory as the matrix.
    """

    def __init__(self, form: Any):
        self._form = form
        self.blocks: PETSc.Mat | None = None  #: None before the first assembly

    def assemble(self, matrix: PETSc.Mat) -> None:
        """Overwrite the entries of a matrix of `fem.create_matrix`, without finishing it (collective)."""
        blocks = self.blocks
        if blocks is not None and (rows := block_rows(blocks)) is not None and has_entries_of(matrix, rows):
            write_entries(matrix, self._filled(blocks, rows))
            return
        matrix.zeroEntries()
        fem.assemble_matrix(matrix, self._form)
        if blocks is None and matrix.getType() == PETSc.Mat.Type.SEQAIJ and matrix.getBlockSize() > 1:
            matrix.assemble()
            self.blocks = _of_blocks(matrix)

    def assemble_blocks(self) -> BlockRows | None:
        """The blocks alone, until the next assembly; None before there are any."""
        rows = None if self.blocks is None else block_rows(self.blocks)
        return None if rows is None else self._filled(self.blocks, rows)

    def _filled(self, blocks: PETSc.Mat, rows: BlockRows) -> BlockRows:
        blocks.zeroEntries()
        fem.assemble_matrix(blocks, self._form)
        blocks.assemble()
        return rows


def _of_blocks(matrix: PETSc.Mat) -> PETSc.Mat:
    """A matrix of blocks of zeros with the pattern of an assembled one of one process."""
    n = matrix.getBlockSize()
    start, columns, _ = matrix.getValuesCSR()
    nodes = columns.reshape(-1, n)[:, 0] // n  # those of each row, n times
    first = np.repeat(np.arange(len(start) - 1) % n == 0, np.diff(start) // n)
    begin = (np.concatenate([[0], np.cumsum(np.diff(start)[::n])]) // n).astype(PETSc.IntType)
    chosen = nodes[first].astype(PETSc.IntType)
    blocks = PETSc.Mat().createBAIJ(
        matrix.size, n, csr=(begin, chosen, np.zeros(len(chosen) * n * n)), comm=matrix.comm
    )
    blocks.setLGMap(*matrix.getLGMap())
    return blocks
