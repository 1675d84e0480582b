"""A system of two fields as a matrix of blocks, and block Gauss-Seidel as its preconditioner.

    [ A11  A12 ]        y1 = P1 x1,    y2 = P2 (x2 - A21 y1)
    [ A21  A22 ]

with preconditioners P1 of A11 and P2 of A22. PETSc's own `nest` and `fieldsplit` take four times as long for dense
blocks, and multiply the second field by zeros.
Source: Gee, Kuttler, Wall, Int. J. Numer. Meth. Engng 85 (2011) 987-1016.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from petsc4py import PETSc

from solvers.algebra.petsc_python import PythonContext


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

    def __init__(self, first: Callable[[PETSc.Mat], PETSc.KSP], second: PETSc.PC):
        self._first, self.second = first, second
        self._factors: PETSc.KSP | None = None
        self._fields: TwoFields | None = None

    def setUp(self, preconditioner: PETSc.PC) -> None:
        self._fields = fields = preconditioner.getOperators()[1].getPythonContext()
        (A11, _), (_, A22) = fields.blocks
        self._factors = self._first(A11)
        self.second.setOperators(A22)
        self.second.setUp()
        self.second.setReusePreconditioner(True)  # also when the matrix changes, until this is set up again

    def apply(self, preconditioner: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        assert self._fields is not None
        assert self._factors is not None
        fields, A21 = self._fields, self._fields.blocks[1][0]
        with fields.parts(x) as (x1, x2), fields.parts(y) as (y1, y2):
            self._factors.solve(x1, y1)
            right = x2.duplicate()
            A21.mult(y1, right)
            right.aypx(-1.0, x2)
            self.second.apply(right, y2)
            if self._factors.getConvergedReason() < 0:
                y1.set(math.nan)  # the outer method stops at it
