"""Prescribed displacements in arrays and linear systems of all bodies."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.blocks import Layout
from solvers.api import Array
from solvers.structure.supports import Prescribed


class Held:
    """The prescribed displacements of a structure: dofs along axes, and oblique directions at nodes.

    Let P be the projection on the prescribed directions. Then u = (1 - P) u + u_p, and a linear system K du = b with
    P du = m becomes

        ((1 - P) K (1 - P) + d P) du = (1 - P) (b - K m) + d m.
    """

    def __init__(self, layout: Layout, supports: Sequence[Prescribed], dim: int):
        self._layout, self._supports, self._dim = layout, supports, dim
        starts = layout.offsets[:-1]
        self.dofs = np.concatenate([s.dofs + start for s, start in zip(supports, starts, strict=True)]).astype(np.int64)
        nodes = [dim * s.oblique.blocks + start for s, start in zip(supports, starts, strict=True)]
        self._nodes = np.concatenate(nodes).astype(np.int64)[:, None] + np.arange(dim)  #: owned dofs, (k, dim)
        self._projections = np.concatenate([s.oblique.projections for s in supports])
        self.oblique = layout.comm.allreduce(len(self._nodes)) > 0  #: on any process
        self._stopped_at: Array | None = None
        self._free: PETSc.Mat | None = None  #: see `_assemble_free`

    def stopped(self, dofs: NDArray[np.int64], u: Array) -> Held:
        """A copy that prescribes these owned dofs too, with the displacement u [m] at all prescribed dofs."""
        held = copy(self)
        held.dofs = np.union1d(self.dofs, dofs)
        held._stopped_at = held.part(u)
        return held

    def part(self, array: Array) -> Array:
        """P a of an array of owned dofs."""
        held = self._along(array)
        held[self.dofs] = array[self.dofs]
        return held

    def free_part(self, array: Array) -> Array:
        """a - P a; exactly zero at held dofs, even if a is not finite there."""
        free = array - self._along(array) if self.oblique else array.copy()
        free[self.dofs] = 0.0
        return free

    def displacement(self, t: float) -> Array:
        """u_p [m] at owned dofs and the time t [s], zero at free ones."""
        if self._stopped_at is not None:
            return self._stopped_at
        whole = np.zeros(self._layout.size)
        whole[self.dofs] = np.concatenate([support.displacement(t) for support in self._supports])
        if self.oblique:
            whole[self._nodes] = np.concatenate([support.oblique.displacement(t) for support in self._supports])
        return whole

    def reached(self, u: Array, target: Array, size: float) -> bool:
        """Whether P u is the target on this process: exactly at held dofs, up to rounding along oblique directions.

        size: of the largest body [m], for the rounding of positions.
        """
        if not np.array_equal(u[self.dofs], target[self.dofs]):
            return False
        if not self.oblique:
            return True
        missed = (self._along(u) - target)[self._nodes]
        rounding = 4.0 * np.finfo(float).eps * (size + np.abs(u[self._nodes]).max(initial=0.0))
        return bool(np.all(np.abs(missed) <= rounding))

    def impose(self, matrix: PETSc.Mat, x: PETSc.Vec, b: PETSc.Vec) -> PETSc.Mat:
        """Impose the held part of x on a symmetric system; b changes in place, and the matrix is overwritten."""
        if self.oblique:
            free, scale = self._assemble_free(), _mean_diagonal(matrix)
            missing = x.duplicate()
            missing.array[:] = self._along(x.array)
            b.axpy(-1.0, matrix * missing)
            b.array[:] = b.array - self._along(b.array) + scale * missing.array
            matrix = matrix.ptap(free)
            matrix.axpy(scale, self._identity_minus(free), PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        matrix.zeroRowsColumns(self._rows, 1.0, x, b)
        return matrix

    def impose_rows(self, blocks: Sequence[PETSc.Mat], x: Array, b: Array) -> list[PETSc.Mat]:
        """Impose the held part of x on rows only. blocks: a row of blocks, its own first; x, b: at owned dofs.

        On each process, further rows may come behind the owned dofs.
        """
        changed = list(blocks)
        if self.oblique:
            scale = _mean_diagonal(blocks[0])
            b[:] = b - self._along(b) + scale * self._along(x)
            free = self._assemble_free()
            if blocks[0].getSize()[0] > free.getSize()[0]:
                free = self._assemble_free_before(blocks[0].getLocalSize()[0] - self._layout.size)
            changed = [free.matMult(block) for block in blocks]
            held = self._identity_minus(free)
            changed[0].axpy(scale, held, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        for index, block in enumerate(changed):
            block.zeroRows(self._rows, 1.0 if index == 0 else 0.0)
        b[self.dofs] = x[self.dofs]
        return changed

    @property
    def _rows(self) -> NDArray[np.int32]:
        return (self._layout.start + self.dofs).astype(PETSc.IntType)

    def _along(self, array: Array) -> Array:
        """The part of an array along oblique directions."""
        part = np.zeros_like(array)
        if self.oblique:
            part[self._nodes] = np.einsum("kij,kj->ki", self._projections, array[self._nodes])
        return part

    def _assemble_free(self) -> PETSc.Mat:
        """1 - P of the oblique directions, with explicit ones on the diagonal elsewhere; once (collective)."""
        if self._free is None:
            self._free = self._assemble_free_before(0)
        return self._free

    def _assemble_free_before(self, more: int) -> PETSc.Mat:
        """The same, with `more` further rows of this process behind its dofs, on the last one alone (collective)."""
        size = self._layout.size + more
        matrix = PETSc.Mat().createAIJ([(size, None)] * 2, nnz=(self._dim, 0), comm=self._layout.comm)
        others = np.ones(size, dtype=bool)
        others[self._nodes] = False
        for dof in (self._layout.start + np.flatnonzero(others)).tolist():
            matrix.setValue(dof, dof, 1.0)
        for dofs, projection in zip(self._layout.start + self._nodes, self._projections, strict=True):
            rows = dofs.astype(PETSc.IntType)
            matrix.setValues(rows, rows, np.eye(self._dim) - projection)
        matrix.assemble()
        return matrix

    @staticmethod
    def _identity_minus(matrix: PETSc.Mat) -> PETSc.Mat:
        rest = matrix.copy()
        rest.scale(-1.0)
        rest.shift(1.0)
        return rest


def _mean_diagonal(matrix: PETSc.Mat) -> float:
    """Mean magnitude of the diagonal, the scale of imposed rows."""
    diagonal = matrix.getDiagonal()
    return float(diagonal.norm(PETSc.NormType.NORM_1) / max(diagonal.getSize(), 1))
