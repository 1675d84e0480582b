"""A system of two fields as a matrix of blocks, and block Gauss-Seidel as its preconditioner.

    [ A11  A12 ]        y1 = P1 x1,    y2 = P2 (x2 - A21 y1)
    [ A21  A22 ]

with preconditioners P1 of A11 and P2 of A22. PETSc's own `nest` and `fieldsplit` take four times as long for dense
blocks, and multiply the second field by zeros.

A22 may be singular with A22 Z = 0 and Z^T A22 = 0, as that of a flow in a closed box with an elastic body: Z has the
pressure levels, which the body determines. P2 enlarges sources in Z without bound. The levels l are solved for with the
first field, which leaves no such source, and then taken from the second one:

    A11 y1 + A12 Z l = x1,    Z^T A21 y1 = Z^T x2,    y2 = Z l + (1 - Z (Z^T Z)^-1 Z^T) P2 (x2 - A21 y1)

Sources: Gee, Kuttler, Wall, Int. J. Numer. Meth. Engng 85 (2011) 987-1016; Benzi, Golub, Liesen, Acta Numerica 14
(2005) 1-137, section 5.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from solvers.algebra.petsc_python import PythonContext
from solvers.api import Array


@dataclass(frozen=True)
class TwoFields(PythonContext):
    """Context of a matrix of blocks. Each process has rows of the first field, then those of the second."""

    blocks: tuple[tuple[PETSc.Mat, PETSc.Mat], tuple[PETSc.Mat, PETSc.Mat]]
    first: PETSc.IS
    second: PETSc.IS
    product: PETSc.Mat | None = None  #: the last block as it multiplies vectors; None: as it is

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        with self.parts(x) as (x1, x2), self.parts(y) as (y1, y2):
            (A11, A12), (A21, A22) = self.blocks
            A11.mult(x1, y1)
            A12.multAdd(x2, y1, y1)
            (self.product or A22).mult(x2, y2)
            A21.multAdd(x1, y2, y2)

    @contextmanager
    def parts(self, vector: PETSc.Vec) -> Iterator[tuple[PETSc.Vec, PETSc.Vec]]:
        """Views of a vector by field."""
        views = tuple(vector.getSubVector(part) for part in (self.first, self.second))
        yield views
        for part, view in zip((self.first, self.second), views, strict=True):
            vector.restoreSubVector(part, view)


def matrix_of(fields: TwoFields) -> PETSc.Mat:
    """The matrix of a system (collective)."""
    (first, _), (_, second) = fields.blocks
    own = first.getLocalSize()[0] + second.getLocalSize()[0]
    return PETSc.Mat().createPython(((own, None), (own, None)), fields, comm=second.comm)


class GaussSeidel(PythonContext):
    """Context of a preconditioner: `first` makes that of the first field, `second` is that of the other one."""

    def __init__(self, first: Callable[[PETSc.Mat], PETSc.KSP], second: PETSc.PC, levels: Array | None = None):
        """levels: Z at owned unknowns, shape (owned, levels), with orthogonal columns; None: A22 is regular."""
        self._first, self.second, self._Z = first, second, levels
        self._levels: _Levels | None = None
        self._factors: PETSc.KSP | None = None
        self._fields: TwoFields | None = None

    def setUp(self, preconditioner: PETSc.PC) -> None:
        self._fields = fields = preconditioner.getOperators()[1].getPythonContext()
        (A11, _), (_, A22) = fields.blocks
        self._factors = self._first(A11)
        self.second.setOperators(A22)
        self.second.setUp()
        self.second.setReusePreconditioner(True)  # also when the matrix changes, until this is set up again
        self._levels = None if self._Z is None else _Levels(self._Z, fields, self._factors)

    def apply(self, preconditioner: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        assert self._fields is not None
        assert self._factors is not None
        fields, A21 = self._fields, self._fields.blocks[1][0]
        with fields.parts(x) as (x1, x2), fields.parts(y) as (y1, y2):
            self._factors.solve(x1, y1)
            levels = None if self._levels is None else self._levels.correct(y1, x2)
            right = x2.duplicate()
            A21.mult(y1, right)
            right.aypx(-1.0, x2)
            self.second.apply(right, y2)
            if self._levels is not None and levels is not None:
                self._levels.set(y2, levels)
            if self._factors.getConvergedReason() < 0:
                y1.set(math.nan)  # the outer method stops at it


class _Levels:
    """The levels l of Z with the first field (collective)."""

    def __init__(self, Z: Array, fields: TwoFields, factors: PETSc.KSP):
        """factors: approximate those of A11; the equations of the levels are exact with them, too."""
        (A11, A12), (A21, _) = fields.blocks
        self._comm, self._Z = A11.comm.tompi4py(), Z
        owned = A11.getLocalSize()[0]
        self._moved, self._sources = np.empty((owned, Z.shape[1])), np.empty((owned, Z.shape[1]))
        moved, right = A11.createVecs()
        level = A12.createVecRight()
        for number, values in enumerate(Z.T):
            level.array[:] = values
            A12.mult(level, right)
            factors.solve(right, moved)
            self._moved[:, number] = moved.array_r
            A21.multTranspose(level, moved)
            self._sources[:, number] = moved.array_r
        self._schur = -self._sum(self._sources.T @ self._moved)
        self._squares = self._sum((Z**2).sum(axis=0))

    def _sum(self, values: Array) -> Array:
        return values if self._comm.size == 1 else self._comm.allreduce(values)

    def correct(self, y1: PETSc.Vec, x2: PETSc.Vec) -> Array:
        """l, with which y1 is corrected so that there is no source in Z."""
        given = self._sum(self._Z.T @ x2.array_r - self._sources.T @ y1.array_r)
        found: Array = np.linalg.lstsq(self._schur, given, rcond=None)[0]
        y1.array[:] -= self._moved @ found
        return found

    def set(self, y2: PETSc.Vec, levels: Array) -> None:
        """Replace the part of y2 in Z."""
        own = self._sum(self._Z.T @ y2.array_r) / self._squares
        y2.array[:] += self._Z @ (levels - own)
