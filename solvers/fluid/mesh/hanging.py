"""Hanging nodes: nodes of finer cells on a face or edge of a coarser cell that are no nodes of the coarser cell.

Their values are those of the polynomial of the coarser cell, u_i = sum_b N_b(x_i) u_b. With the matrix T of these rows,
and rows of the identity elsewhere, the equation is T^T r(T u) = 0. No b is a hanging node itself, because cells at a
corner differ by one level at most.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.rows import from_entries
from solvers.api import Array, Indices, Mask
from solvers.fluid.grid.nested import Nested
from solvers.fluid.mesh.directory import Directory


class Hanging:
    """Hanging nodes of velocity and pressure. Rows and values are arrays over owned dofs."""

    def __init__(
        self,
        comm: MPI.Comm,
        grid: Nested,
        lattices: Sequence[tuple[NDArray[np.int32], Indices, int, int]],
        global_dofs: Indices,
        owned: int,
        cell_dofs: Sequence[NDArray[np.int32]],
    ):
        """Collective.

        lattices: for each quantity local dofs (nodes, components), numbers of the nodes, count of owned ones, degree.
        cell_dofs: dofs of the local cells, in any number of arrays.
        """
        self.dofs: Mask = np.zeros(len(global_dofs), dtype=bool)  #: mask of the local dofs of hanging nodes
        rows, columns, data = [], [], []
        for dofs, numbers, own, degree in lattices:
            all_numbers = grid.all_nodes(degree)
            consecutive, of_dofs = np.searchsorted(all_numbers, numbers[:own]), global_dofs[dofs]
            directory = Directory(comm, consecutive, of_dofs[:own], len(all_numbers))
            hangs, masters, weights = grid.hanging(degree, numbers)
            self.dofs[dofs[hangs]] = True
            mine = np.flatnonzero(hangs)[: np.count_nonzero(hangs[:own])]
            at, function = np.nonzero(weights[: len(mine)])
            columns.append(directory(np.searchsorted(all_numbers, masters[at, function])))
            rows.append(of_dofs[mine[at]])
            data.append(np.broadcast_to(weights[at, function][:, None], rows[-1].shape))
        free = global_dofs[:owned][~self.dofs[:owned]]
        entries = [np.concatenate([first, *(some.ravel() for some in parts)])
                   for first, parts in ((free, rows), (free, columns), (np.ones(len(free)), data))]  # fmt: skip
        self._table = from_entries(comm, (owned, owned), *entries)
        #: mask of the local cells with hanging nodes
        self.cells: Mask = np.any([self.dofs[dofs].reshape(len(dofs), -1).any(axis=1) for dofs in cell_dofs], axis=0)

    def values(self, values: Array) -> Array:
        """T u (collective)."""
        u, found = self._table.createVecs()
        u.array[:] = values
        self._table.mult(u, found)
        return found.array

    def rows(self, rows: Array) -> Array:
        """T^T r (collective)."""
        found, r = self._table.createVecs()
        r.array[:] = rows
        self._table.multTranspose(r, found)
        return found.array

    def matrix(self, matrix: PETSc.Mat) -> tuple[Indices, Indices, Array]:
        """T^T K T by compressed rows (collective)."""
        product = matrix.PtAP(self._table)
        rows = product.getValuesCSR()
        product.destroy()
        return rows
