"""The matrix of a monolithic Newton step, field by field."""

from __future__ import annotations

from dataclasses import dataclass

from petsc4py import PETSc

from solvers.rows import Numbering
from solvers.structure.field import Structure


@dataclass
class Blocks:
    """[[structure, into_structure], [into_fluid, fluid]]."""

    structure: PETSc.Mat
    into_structure: PETSc.Mat
    into_fluid: PETSc.Mat
    fluid: PETSc.Mat

    def create_vectors(self) -> tuple[PETSc.Vec, PETSc.Vec]:
        """Two vectors with, on each process, the structure's rows and then the fluid's."""
        own = self.structure.getLocalSize()[0] + self.fluid.getLocalSize()[0]
        vector = PETSc.Vec().create(comm=self.fluid.comm)
        vector.setSizes((own, None))
        vector.setType(PETSc.Vec.Type.STANDARD)
        return vector, vector.duplicate()

    def condense(self, field: Structure, b: PETSc.Vec, numbering: Numbering) -> None:
        """Eliminate the multipliers of the structure's constraint; its rows and those of b change (collective)."""
        rows = PETSc.Mat().createNest([[self.structure, self.into_structure]], comm=self.fluid.comm)
        rows = field.condense(rows.convert(PETSc.Mat.Type.AIJ, PETSc.Mat()), b, numbering)
        self.structure, self.into_structure = numbering.split(rows)

    def hold(self, field: Structure, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Rows of prescribed displacements ask for what x has there (collective)."""
        own = self.structure.getLocalSize()[0]
        beside = [self.structure, self.into_structure]
        self.structure, self.into_structure = field.held.impose_rows(beside, x.array[:own], b.array[:own])

    def nested(self) -> PETSc.Mat:
        """The matrix that still consists of the blocks."""
        blocks = [[self.structure, self.into_structure], [self.into_fluid, self.fluid]]
        return PETSc.Mat().createNest(blocks, comm=self.fluid.comm)

    def assembled(self) -> PETSc.Mat:
        """The same as one sparse matrix."""
        return self.nested().convert(PETSc.Mat.Type.AIJ, PETSc.Mat())
