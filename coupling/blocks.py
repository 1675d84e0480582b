"""The matrix of a monolithic Newton step, field by field."""

from __future__ import annotations

from dataclasses import dataclass

from petsc4py import PETSc

from coupling.ports import Solid
from solvers.rows import Numbering, RowTransformation, TakenRows, transform_rows


@dataclass
class Blocks:
    """[[solid, into_solid], [into_flow, flow]]."""

    solid: PETSc.Mat
    into_solid: PETSc.Mat
    into_flow: PETSc.Mat
    flow: PETSc.Mat

    def create_vectors(self) -> tuple[PETSc.Vec, PETSc.Vec]:
        """Two vectors with, on each process, the solid's rows and then the flow's."""
        own = self.solid.getLocalSize()[0] + self.flow.getLocalSize()[0]
        vector = PETSc.Vec().create(comm=self.flow.comm)
        vector.setSizes((own, None))
        vector.setType(PETSc.Vec.Type.STANDARD)
        return vector, vector.duplicate()

    def transform(self, change: RowTransformation, b: PETSc.Vec, numbering: Numbering) -> TakenRows:
        """Eliminate the multipliers of contact; the solid's rows and those of b change (collective)."""
        rows = PETSc.Mat().createNest([[self.solid, self.into_solid]], comm=self.flow.comm)
        rows, taken = transform_rows(rows.convert(PETSc.Mat.Type.AIJ, PETSc.Mat()), b, change, numbering)
        self.solid, self.into_solid = numbering.split(rows)
        return taken

    def hold(self, part: Solid, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Rows of prescribed displacements ask for what x has there (collective)."""
        own = self.solid.getLocalSize()[0]
        beside = [self.solid, self.into_solid]
        self.solid, self.into_solid = part.impose_rows(beside, x.array[:own], b.array[:own])

    def nested(self) -> PETSc.Mat:
        """The matrix that still consists of the blocks."""
        blocks = [[self.solid, self.into_solid], [self.into_flow, self.flow]]
        return PETSc.Mat().createNest(blocks, comm=self.flow.comm)

    def assembled(self) -> PETSc.Mat:
        """The same as one sparse matrix."""
        return self.nested().convert(PETSc.Mat.Type.AIJ, PETSc.Mat())
