"""Integrals over the faces at the ends of periods, which are no faces of the mesh: those of the ghost penalty.

The process that owns the cell at the start of the period assembles the face. What depends on the cell at the end comes
from the process that owns that one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.algebra.rows import from_entries
from solvers.api import Array, Indices, Indices32
from solvers.fluid.cut.cut import Cut
from solvers.fluid.mesh.space import Unknowns


@dataclass(frozen=True)
class _Seam:
    """The faces at the ends of one period that this process assembles."""

    axis: int
    cells: Indices32  #: owned cells at the start
    start: Indices  #: their numbers in the box
    end: Indices  #: numbers of the cells at the end that they meet
    dofs: Indices  #: global dofs of both cells, that at the start first, (faces, dofs)


class SeamPenalty:
    """Integrals over the seams of all periods of a flow without cells of the sides of thin bodies."""

    def __init__(self, unknowns: Unknowns):
        """Collective."""
        self._unknowns, grid = unknowns, unknowns.grid
        self._index = np.stack(np.unravel_index(grid.numbers[: grid.owned], grid.grid.shape, order="F"))
        self._seams = [self._seam(axis) for axis in unknowns.periodic]
        self._on = [np.zeros(len(seam.cells), dtype=bool) for seam in self._seams]
        self._facewise: dict[fem.Integral, fem.Facewise] = {}

    def _seam(self, axis: int) -> _Seam:
        unknowns, grid = self._unknowns, self._unknowns.grid
        shape, size = grid.grid.shape, unknowns.block_size
        cells = np.flatnonzero(self._index[axis] == 0).astype(np.int32)
        start = grid.numbers[cells]
        end = start + (shape[axis] - 1) * int(np.prod(shape[:axis]))
        blocks = unknowns.cell_blocks[: grid.owned, :, None] * size + np.arange(size)
        dofs = unknowns.global_dofs[blocks.reshape(grid.owned, -1)]
        mine = np.flatnonzero(self._index[axis] == shape[axis] - 1)
        return _Seam(axis, cells, start, end, np.hstack([dofs[cells], self._of_end(dofs[mine], mine, end)]))

    def _of_end(self, rows: NDArray, mine: Indices, end: Indices) -> NDArray:
        """Rows for the cells with the numbers `end`, from those for owned cells at the end (collective)."""
        grid = self._unknowns.grid
        parts = grid.comm.allgather((grid.numbers[mine], rows))
        numbers, rows = (np.concatenate(column) for column in zip(*parts, strict=True))
        order = np.argsort(numbers)
        return np.asarray(rows[order[np.searchsorted(numbers[order], end)]])

    def set_cut(self, cut: Cut) -> bool:
        """Take the faces between active cells of which one is poorly cut; whether these are others than before."""
        before, self._on = self._on, []
        for seam in self._seams:
            ends = np.stack([seam.start, seam.end])
            self._on.append(cut.special[ends].any(axis=0) & cut.is_active[ends].all(axis=0))
        return not all(map(np.array_equal, before, self._on))

    def entries(self) -> NDArray[np.int64]:
        """Count of entries that owned rows may have (collective)."""
        matrix = self._matrix(None)
        found = np.diff(matrix.getValuesCSR()[0]).astype(np.int64)
        matrix.destroy()
        return found

    def fill(self, matrix: PETSc.Mat) -> None:
        """Insert all entries that it may have (collective)."""
        self._add(matrix, None)

    def assemble_matrix(self, matrix: PETSc.Mat, form: fem.Integral) -> None:
        """Add a bilinear form (collective)."""
        self._add(matrix, form)

    def assemble_vector(self, form: fem.Integral, out: Array) -> None:
        """Add a linear form at owned dofs of an array over local dofs (collective)."""
        vector = PETSc.Vec().createMPI((self._unknowns.owned, None), comm=self._unknowns.grid.comm)
        for seam, on, tensors in zip(self._seams, self._on, self._tensors(form), strict=True):
            vector.setValues(seam.dofs[on].ravel().astype(PETSc.IntType), tensors.ravel(), addv=True)
        vector.assemble()
        out[: self._unknowns.owned] += vector.array
        vector.destroy()

    def _tensors(self, form: fem.Integral) -> list[Array]:
        """Those of the faces that count, by seam (collective)."""
        grid, found = self._unknowns.grid, []
        if form not in self._facewise:
            self._facewise[form] = fem.Facewise(grid.domain, form)
        facewise = self._facewise[form]
        for seam, on in zip(self._seams, self._on, strict=True):
            edge = grid.grid.edges[seam.axis]
            mine = np.flatnonzero(self._index[seam.axis] == grid.grid.shape[seam.axis] - 1)
            there = self._of_end(facewise.data(mine.astype(np.int32)), mine, seam.end[on])
            found.append(facewise.between(facewise.data(seam.cells[on]), there, seam.axis, float(edge[0] - edge[-1])))
        return found

    def _add(self, matrix: PETSc.Mat, form: fem.Integral | None) -> None:
        own = self._matrix(form)
        matrix.setValuesCSR(*own.getValuesCSR(), addv=PETSc.InsertMode.ADD_VALUES)
        own.destroy()

    def _matrix(self, form: fem.Integral | None) -> PETSc.Mat:
        """The matrix of a form; None: that with all entries of all seams (collective)."""
        rows, columns, data = [], [], []
        if form is None:
            parts = [(seam.dofs, np.ones((*seam.dofs.shape, seam.dofs.shape[1]))) for seam in self._seams]
        else:
            found = self._tensors(form)
            parts = [(seam.dofs[on], some) for seam, on, some in zip(self._seams, self._on, found, strict=True)]
        for dofs, blocks in parts:
            rows.append(np.broadcast_to(dofs[:, :, None], blocks.shape).ravel())
            columns.append(np.broadcast_to(dofs[:, None, :], blocks.shape).ravel())
            data.append(blocks.ravel())
        entries = (np.concatenate(some) for some in (rows, columns, data))
        owned = self._unknowns.owned
        return from_entries(self._unknowns.grid.comm, (owned, owned), *entries)
