"""The derivative of the vertices of surfaces by the unknowns of a solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.sparse import Sparse, sparse_from_entries


@dataclass(frozen=True)
class VertexJacobian:
    """B: derivative of the vertices' displacements by the unknowns of a solid, k entries for each dof of a vertex.

    A vertex has the dofs number * dim + axis. Elastic bodies have one entry of 1, rigid ones the arms of their
    rotations besides.
    """

    columns: NDArray[np.int64]  #: global unknowns, shape (vertices * dim, k)
    values: Array  #: of the same shape

    def transposed(self, unknowns: int) -> Sparse:
        """B^T, for as many unknowns on all processes."""
        n, k = self.columns.shape
        dofs = np.repeat(np.arange(n), k)
        return sparse_from_entries(self.columns.ravel(), dofs, self.values.ravel(), (unknowns, n))
