"""Matrices between the vertices of surfaces and the unknowns of fields, entry by entry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.sparse import sparse_from_entries


@dataclass(frozen=True)
class Entries:
    """Entries of a sparse matrix; several of one row and column add up. A vertex has the dofs number * dim + axis."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: Array

    def scaled(self, factor: float) -> Entries:
        return Entries(self.rows, self.columns, factor * self.values)

    @property
    def transposed(self) -> Entries:
        return Entries(self.columns, self.rows, self.values)


@dataclass(frozen=True)
class VertexJacobian:
    """B: derivative of the vertices' displacements by the unknowns of a solid, k entries for each dof of a vertex.

    Elastic bodies have one entry of 1, rigid ones the arms of their rotations besides.
    """

    columns: NDArray[np.int64]  #: global unknowns, shape (vertices * dim, k)
    values: Array  #: of the same shape

    def times(self, entries: Entries) -> Entries:
        """A B for a matrix A whose columns are dofs of vertices."""
        rows, at, values = self._summed(entries)
        products = values[:, None] * self.values[at]
        return Entries(np.repeat(rows, self.columns.shape[1]), self.columns[at].ravel(), products.ravel())

    def transposed_times(self, entries: Entries) -> Entries:
        """B^T A for a matrix A whose rows are dofs of vertices."""
        return self.times(entries.transposed).transposed

    def _summed(self, entries: Entries) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
        """(rows, columns, values); several entries of one row and column are added before each becomes k."""
        rows, columns, values = entries.rows, entries.columns, entries.values
        if self.columns.shape[1] == 1 or not len(rows):
            return rows, columns, values
        shape = (int(rows.max()) + 1, len(self.columns))
        summed = sparse_from_entries(rows, columns, values, shape)
        return summed.row_numbers().astype(np.int64), summed.indices.astype(np.int64), summed.data
