"""The matrix of a monolithic Newton iteration as blocks of fields."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from coupling.ports import Solid
from solvers.algebra.added_product import with_product
from solvers.algebra.gauss_seidel import TwoFields, matrix_of
from solvers.algebra.rows import Numbering, RowTransformation, TakenRows, transform_rows
from solvers.api import Array


@dataclass
class Blocks:
    """The blocks [[solid, into_solid], [into_flow, flow]]."""

    solid: PETSc.Mat
    into_solid: PETSc.Mat
    into_flow: PETSc.Mat
    flow: PETSc.Mat
    #: parts of low rank of `solid` and of `flow`, as products with their unknowns
    added: tuple[Callable[[Array], Array] | None, Callable[[Array], Array] | None] = (None, None)

    def create_vectors(self) -> tuple[PETSc.Vec, PETSc.Vec]:
        """Two vectors; each process has the rows of the solid, then those of the flow."""
        own = self.solid.getLocalSize()[0] + self.flow.getLocalSize()[0]
        vector = PETSc.Vec().create(comm=self.flow.comm)
        vector.setSizes((own, None))
        vector.setType(PETSc.Vec.Type.STANDARD)
        return vector, vector.duplicate()

    def transform(self, change: RowTransformation, b: PETSc.Vec, numbering: Numbering) -> TakenRows:
        """Eliminate the multipliers of contact (collective). The rows of the solid and of b change in place.

        Returns the rows before the change, from which `Solid.recover` computes the multipliers.
        """
        rows = PETSc.Mat().createNest([[self.solid, self.into_solid]], comm=self.flow.comm)
        rows, taken = transform_rows(rows.convert(PETSc.Mat.Type.AIJ, PETSc.Mat()), b, change, numbering)
        self.solid, self.into_solid = numbering.split(rows)
        return taken

    def hold(self, part: Solid, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Replace the rows of prescribed displacements by du = x; b changes in place (collective)."""
        own = self.solid.getLocalSize()[0]
        beside = [self.solid, self.into_solid]
        self.solid, self.into_solid = part.impose_rows(beside, x.array[:own], b.array[:own])

    def product(self, numbering: Numbering, flow: PETSc.Mat) -> PETSc.Mat:
        """The matrix as its product with vectors, and that of the flow as it multiplies them."""
        blocks = (self.solid, self.into_solid), (self.into_flow, self.flow)
        return matrix_of(TwoFields(blocks, numbering.first, numbering.second, flow))

    def with_added(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """The matrix of all blocks with the parts of low rank."""
        own = self.solid.getLocalSize()[0]
        if self.added == (None, None):
            return matrix

        def product(x: Array) -> Array:
            parts = zip(self.added, (x[:own], x[own:]), strict=True)
            return np.concatenate([np.zeros(len(part)) if added is None else added(part) for added, part in parts])

        return with_product(matrix, product)

    def assembled(self) -> PETSc.Mat:
        """The matrix as one sparse matrix."""
        nested = PETSc.Mat().createNest(
            [[self.solid, self.into_solid], [self.into_flow, self.flow]], comm=self.flow.comm
        )
        return nested.convert(PETSc.Mat.Type.AIJ, PETSc.Mat())
