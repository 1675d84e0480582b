"""Products with a matrix of dense blocks whose entries are rounded to single precision: half of the memory to read.

Newton's method computes residuals without the matrix: a rounded one changes the increments, not the solution.
Source: Carson, Higham, SIAM J. Sci. Comput. 40 (2018) A817-A847 (a correction with fewer digits than the residual).
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from solvers import kernels
from solvers.algebra.petsc_blocks import SharedBlockRows, shared_block_rows
from solvers.algebra.petsc_python import PythonContext
from solvers.api import Array

#: Rows and columns of a block: velocity and pressure in 3D.
BLOCK_SIZE = 4
#: Tolerance of linear systems from which on they may be rounded: entries are to 6e-8.
LOOSE = 1e-5


class RoundedProducts:
    """Gives each matrix as its product with vectors: rounded if the tolerance of the linear system allows it."""

    def __init__(self) -> None:
        self._last: tuple[int, int] | None = None  #: the matrix and its state
        self._product: PETSc.Mat | None = None

    def of(self, matrix: PETSc.Mat, tolerance: float) -> PETSc.Mat:
        """The matrix with rounded entries, without the entries themselves, or the matrix itself (collective).

        The next call overwrites it. tolerance: of the residual of the linear system, relative to the first.
        """
        if tolerance < LOOSE or (rows := shared_block_rows(matrix)) is None or rows.own.values.shape[1] != BLOCK_SIZE:
            return matrix
        if self._product is None or self._last is None or self._last[0] != matrix.handle:
            sizes = matrix.getSizes()
            self._product = PETSc.Mat().createPython(sizes, _Product(matrix, rows), comm=matrix.comm)
            self._last = None
        now = matrix.handle, matrix.stateGet()
        if self._last != now:
            self._product.getPythonContext().update(matrix, rows)
            self._product.stateIncrease()
            self._last = now
        return self._product


class _Product(PythonContext):
    """Context of the rounded matrix: the blocks in columns of this process, and those in columns of others."""

    def __init__(self, matrix: PETSc.Mat, rows: SharedBlockRows):
        width = len(rows.own.start) - 1
        self._own = kernels.BlockProduct(rows.own.start, rows.own.columns, width)
        self._others = kernels.BlockProduct(rows.others.start, rows.others.columns, len(rows.ghosts))
        self._vector = matrix.createVecRight()
        self._ghosts = PETSc.Vec().createSeq(BLOCK_SIZE * len(rows.ghosts), comm=PETSc.COMM_SELF)
        of_ghosts = PETSc.IS().createBlock(BLOCK_SIZE, rows.ghosts, comm=PETSc.COMM_SELF)
        self._scatter = PETSc.Scatter().create(self._vector, of_ghosts, self._ghosts, None)
        self._alone = matrix.comm.size == 1

    def update(self, matrix: PETSc.Mat, rows: SharedBlockRows) -> None:
        scale = _scale(np.abs(matrix.getDiagonal().array_r))
        self._own.update(rows.own.values, scale, scale)
        if not self._alone:
            self._vector.array[:] = scale
            self._scatter.scatter(self._vector, self._ghosts)
            self._others.update(rows.others.values, scale, self._ghosts.array_r.copy())

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        y.set(0.0)
        if not self._alone:
            self._scatter.begin(x, self._ghosts)
        self._own.add(x.array_r, y.array)
        if not self._alone:
            self._scatter.end(x, self._ghosts)
            self._others.add(self._ghosts.array_r, y.array)


def _scale(diagonal: Array) -> Array:
    """Powers of two near 1 / sqrt(diagonal): entries times those of row and column are in the range of the numbers."""
    _, exponent = np.frexp(np.where(diagonal > 0.0, diagonal, 1.0))
    return np.ldexp(1.0, -exponent // 2)
