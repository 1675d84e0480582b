"""A sparse matrix plus a dense part of low rank that is known by its products with vectors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from petsc4py import PETSc

from solvers.algebra.petsc_python import PythonContext
from solvers.api import Array


@dataclass(frozen=True)
class AddedProduct(PythonContext):
    """Context of the matrix A + B, for Krylov methods with a preconditioner of A."""

    matrix: PETSc.Mat  #: A
    product: Callable[[Array], Array]  #: B x at owned unknowns, of x there (collective)

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        self.matrix.mult(x, y)
        y.array[:] += self.product(x.array_r)


def with_product(matrix: PETSc.Mat, product: Callable[[Array], Array]) -> PETSc.Mat:
    """The matrix A + B (collective)."""
    return PETSc.Mat().createPython(matrix.getSizes(), AddedProduct(matrix, product), comm=matrix.comm)
