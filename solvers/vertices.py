"""The derivative of the positions of surface vertices by the unknowns of a solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.sparse import Sparse, sparse_from_entries


@dataclass(frozen=True)
class VertexJacobian:
    """B, the derivative of vertex displacements by the unknowns of a solid, with k entries per dof of a vertex.

    The dofs of a vertex are number * dim + axis. Elastic bodies have one entry of 1, rigid bodies also those of their
    rotations.
    """

    columns: NDArray[np.int64]  #: global unknowns, shape (vertices * dim, k)
    values: Array  #: derivatives, shape (vertices * dim, k)

    def __matmul__(self, unknowns: Array) -> Array:
        """Displacements of the vertices, (vertices * dim,), by a change of the unknowns of all processes."""
        return (self.values * unknowns[self.columns]).sum(axis=1)

    def transposed(self, unknowns: int) -> Sparse:
        """B^T; unknowns: their count on all processes."""
        n, k = self.columns.shape
        dofs = np.repeat(np.arange(n), k)
        return sparse_from_entries(self.columns.ravel(), dofs, self.values.ravel(), (unknowns, n))
