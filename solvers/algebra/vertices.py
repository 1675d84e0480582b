"""The derivative of the positions of surface vertices by the unknowns of a solid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array


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


def one_below_the_other(parts: Sequence[VertexJacobian]) -> VertexJacobian:
    """The derivative of all vertices, from those of some; shorter rows get zeros in their first column."""
    width = max(part.columns.shape[1] for part in parts)
    columns, values = [], []
    for part in parts:
        more = width - part.columns.shape[1]
        columns.append(np.concatenate([part.columns, np.repeat(part.columns[:, :1], more, axis=1)], axis=1))
        values.append(np.pad(part.values, ((0, 0), (0, more))))
    return VertexJacobian(np.concatenate(columns), np.concatenate(values))
