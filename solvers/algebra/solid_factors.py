"""Incomplete factors of a solid in 3D as a preconditioner of PETSc (`pc_type python`): of 3 x 3 blocks, one per node.

Blocks instead of single entries, and single precision: a fifth of PETSc's time to compute, and a quarter to apply.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from solvers import kernels
from solvers.algebra.petsc_blocks import entry_rows, quick_to_multiply
from solvers.algebra.petsc_python import PythonContext

#: Unknowns of a node.
NODE_SIZE = 3


class SolidFactors(PythonContext):
    """Factors of the matrix of one process, whose rows are those of whole nodes; PETSc's, if these do not exist."""

    def __init__(self) -> None:
        self._factors: kernels.BlockFactors | None = None
        self._pattern: tuple[NDArray[np.int32], ...] = ()
        self._other: PETSc.PC | None = None

    def setUp(self, preconditioner: PETSc.PC) -> None:
        multiplied, matrix = preconditioner.getOperators()
        if multiplied.getType() == PETSc.Mat.Type.SEQAIJ:
            quick_to_multiply(multiplied)
        start, columns, blocks = kernels.node_blocks(*entry_rows(matrix), NODE_SIZE)
        pattern = start, columns
        if self._factors is None or not all(map(np.array_equal, pattern, self._pattern)):
            self._factors = kernels.BlockFactors(*pattern, NODE_SIZE, order_by_bandwidth(*pattern))
            self._pattern = pattern
        if not self._factors.update(blocks):
            self._factors, self._other = None, _of_entries(matrix)

    def apply(self, preconditioner: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        if self._factors is not None:
            self._factors.solve(b.array_r, x.array)
        else:
            assert self._other is not None
            self._other.apply(b, x)


def order_by_bandwidth(start: NDArray[np.int32], columns: NDArray[np.int32]) -> NDArray[np.int32]:
    """Rows in an order of small bandwidth (Cuthill and McKee, reversed): a third fewer iterations."""
    count = len(start) - 1
    graph = csr_array((np.ones(len(columns), dtype=np.int8), columns, start), shape=(count, count))
    return reverse_cuthill_mckee(graph, symmetric_mode=False).astype(np.int32, copy=False)


def _of_entries(matrix: PETSc.Mat) -> PETSc.PC:
    preconditioner = PETSc.PC().create(matrix.comm)
    preconditioner.setType(PETSc.PC.Type.ILU)
    preconditioner.setFactorOrdering("rcm")
    preconditioner.setOperators(matrix)
    preconditioner.setUp()
    return preconditioner
