"""The interface `Element`: energy density, stress and tangent of a body in its cells."""

from __future__ import annotations

from typing import Protocol

from petsc4py import PETSc

from solvers.api import State
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

    def smooth_potential(self, F: Tensor) -> Tensor:
        """`potential` at any point of cells and facets, after `prepare_output`."""
        ...

    def begin_step(self, dt: float) -> None:
        """Begin a step of length dt [s] from the present displacement, without the last iterate of that before."""
        ...

    def end_step(self) -> float:
        """Accept the step to the present displacement; returns the work [J] on stresses that relax (collective)."""
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

    def prepare_output(self) -> None:
        """Update what `smooth_potential` needs to the present step (collective)."""
        ...

    def save(self) -> State:
        """The state that the next step starts from, besides the displacement; empty without any."""
        ...

    def restore(self, state: State) -> None:
        """Set what `save` returned."""
        ...
