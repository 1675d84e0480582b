"""The protocol of elements: energy, stress and tangent of a body in its cells."""

from __future__ import annotations

from typing import Protocol

from petsc4py import PETSc

from solvers.structure.materials import Material, Tensor


class Element(Protocol):
    """Energy and stress of a body in its cells."""

    material: Material

    def energy(self, F: Tensor) -> Tensor:
        """Energy per reference volume [J/m^3]."""
        ...

    def potential(self, F: Tensor) -> Tensor:
        """The density [J/m^3] whose derivative in F, all else held fixed, is the stress P."""
        ...

    def tangent_potential(self, F: Tensor) -> Tensor:
        """The density [J/m^3] whose second derivative in F gives the tangent, but for `complete_tangent`."""
        ...

    def begin_step(self) -> None:
        """Newton's method starts anew."""
        ...

    def update(self) -> None:
        """The displacement has changed."""
        ...

    def linearise(self) -> None:
        """A tangent at the present displacement is about to be assembled."""
        ...

    def complete_tangent(self, matrix: PETSc.Mat) -> None:
        """Add to the assembled tangent what fixed quantities contribute by their derivatives [N/m]."""
        ...
