"""The matrix of the penalty on cut cells: it has rows near surfaces only, and is added to that of the flow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.petsc_blocks import SharedBlockRows, shared_block_rows
from solvers.api import Array
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms.matrix import Pattern, create_matrix, quick_copy
from solvers.fluid.terms.poorly_cut.ghost import CutPenalty


class PenaltyMatrix:
    """That of one pattern, for all cuts and scales with this pattern."""

    def __init__(self, unknowns: Unknowns, cut_penalty: CutPenalty, pattern: Pattern, *, blocked: bool):
        across_faces = replace(pattern, cells=np.zeros_like(pattern.cells))
        matrix = create_matrix(unknowns, across_faces, cut_penalty.extra_entries(), blocked=blocked)
        cut_penalty.fill(matrix, pattern)
        matrix.assemble()
        self.matrix, self._cut_penalty = quick_copy(matrix), cut_penalty
        self._flow, self._through = self.matrix.createVecs()
        self._places: list[NDArray[np.int64]] | None = None

    def assemble(self, history: Array) -> None:
        """Set the matrix to the present cut and scales, and the term of earlier steps at local dofs (collective)."""
        self.matrix.zeroEntries()
        self._cut_penalty.assemble(self.matrix, history)
        self.matrix.assemble()

    def times(self, flow: Array) -> Array:
        """Product with owned values (collective)."""
        self._flow.array[:] = flow
        self.matrix.mult(self._flow, self._through)
        return self._through.array

    def add_to(self, matrix: PETSc.Mat) -> None:
        """Add it to the flow's matrix, always the same one (collective)."""
        own, whole = shared_block_rows(self.matrix), shared_block_rows(matrix)
        if own is None or whole is None:
            matrix.axpy(1.0, self.matrix, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
            return
        if self._places is None:
            self._places = [np.searchsorted(*keys) for keys in zip(_keys(whole), _keys(own), strict=True)]
        for part, of, places in zip((whole.own, whole.others), (own.own, own.others), self._places, strict=True):
            part.values[places] += of.values


def _keys(rows: SharedBlockRows) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers of row and column of each block as one number, which grows in the order of the blocks, of both parts."""
    found = []
    for part, columns in ((rows.own, rows.own.columns), (rows.others, rows.ghosts[rows.others.columns])):
        row = np.repeat(np.arange(len(part.start) - 1, dtype=np.int64), np.diff(part.start))
        found.append((row << 32) + columns)
    return found[0], found[1]
