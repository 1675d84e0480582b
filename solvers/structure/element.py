"""The interface `Element`: energy density, stress and tangent of a body in its cells."""

from __future__ import annotations

from typing import Protocol

from petsc4py import PETSc

from solvers.structure.materials import Material, Tensor


class Element(Protocol):
    """An element formulation of one body."""

    material: Material

    def energy(self, F: Tensor) -> Tensor:
        """Energy per reference volume [J/m^3]."""
        ...

    def potential(self, F: Tensor) -> Tensor:
        """The density [J/m^3] whose derivative in F, with all other fields fixed, is the stress P."""
        ...

    def tangent_potential(self, F: Tensor) -> Tensor:
        """The density [J/m^3] whose second derivative in F is the tangent without the term of `complete_tangent`."""
        ...

    def begin_step(self) -> None:
        """Discard the last iterate of the step before."""
        ...

    def update(self) -> None:
        """Update internal fields to the present displacement."""
        ...

    def linearise(self) -> None:
        """Update the fields of the tangent; called before each assembly."""
        ...

    def complete_tangent(self, matrix: PETSc.Mat) -> None:
        """Add the derivatives of eliminated fields to the assembled tangent [N/m]."""
        ...
