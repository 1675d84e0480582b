"""The tangent of cells with hanging nodes: assembled separately, then condensed to the unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.api import Indices32
from solvers.fluid.mesh.hanging import Hanging
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms.matrix import Pattern, create_matrix


class HangingSystem:
    """T^T K T of the cells with hanging nodes. All other cells are assembled directly."""

    def __init__(self, unknowns: Unknowns, table: Hanging, tangent: fem.Integral):
        """tangent: over uncut cells; no cell near a body has hanging nodes."""
        self.table, self._unknowns, self._tangent = table, unknowns, tangent
        self._matrix: PETSc.Mat | None = None
        self._forms: list[Any] = []

    def others(self, cells: Indices32) -> Indices32:
        """The cells without hanging nodes among some local ones."""
        return cells[~self.table.cells[cells]]

    def set_cells(self, uncut: Indices32, more: Sequence[Any]) -> Any:
        """Set the owned uncut cells. Returns the form over those without hanging nodes.

        more: forms over outer faces of cells with hanging nodes.
        """
        self._forms = [self._tangent.on(cell=uncut[self.table.cells[uncut]]), *more]
        return self._tangent.on(cell=self.others(uncut))

    def extra_entries(self) -> NDArray[np.int64]:
        """Count of entries in each owned row; some of them coincide with those of other cells (collective)."""
        return np.diff(self._everywhere()[0]).astype(np.int64)

    def fill(self, matrix: PETSc.Mat) -> None:
        """Insert all entries that the tangent may have, with arbitrary values (collective)."""
        matrix.setValuesCSR(*self._everywhere(), addv=PETSc.InsertMode.ADD_VALUES)

    def add(self, matrix: PETSc.Mat) -> None:
        """Add the tangent (collective)."""
        matrix.setValuesCSR(*self._assembled(self._forms), addv=PETSc.InsertMode.ADD_VALUES)

    def _everywhere(self):
        cells = np.flatnonzero(self.table.cells[: self._unknowns.grid.owned]).astype(np.int32)
        return self._assembled([self._tangent.on(cell=cells)])

    def _assembled(self, forms: Sequence[Any]):
        if self._matrix is None:
            none = np.zeros(len(self._unknowns.grid.find_interior_faces()[0]), dtype=bool)
            pattern = Pattern(self.table.cells, none, np.zeros_like(self.table.cells), by_faces=False)
            self._matrix = create_matrix(self._unknowns, pattern, blocked=False)
        self._matrix.zeroEntries()
        for form in forms:
            fem.assemble_matrix(self._matrix, form)
        self._matrix.assemble()
        return self.table.matrix(self._matrix)
