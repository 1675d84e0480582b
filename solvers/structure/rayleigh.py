"""Rayleigh damping of a structure: of all velocities in proportion to the mass, of strain rates to the stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from solvers.algebra.blocks import block_diagonal
from solvers.api import Array
from solvers.structure.instant import MovingStructure
from solvers.structure.viscosity import Viscosity


@dataclass(frozen=True)
class Damping:
    """Coefficients of the mass matrix [1/s] and of the viscous stress [s]."""

    mass: float = 0.0  #: [1/s]
    stiffness: float = 0.0  #: [s]


class RayleighDamping:
    """The force c_M M v + c_K f(u, v), f of `Viscosity`, and its derivatives at the present displacement."""

    def __init__(self, damping: Damping, structure: MovingStructure):
        """(collective)"""
        self._damping, self._structure = damping, structure
        self._viscosities = [Viscosity(body) for body in structure.bodies] if damping.stiffness else []

    @property
    def symmetric(self) -> bool:
        """Whether its derivative by the displacement is symmetric if velocities are proportional to displacements."""
        return not self._damping.stiffness or all(body.linear for body in self._structure.bodies)

    def force(self, v: Array) -> Array:
        """Force [N] at owned dofs of the velocity v [m/s] (collective)."""
        structure, c = self._structure, self._damping
        force = np.zeros(structure.layout.size)
        if c.mass:
            force += c.mass * structure.inertia.times(v)
        if c.stiffness:
            parts = zip(self._viscosities, structure.layout.split(v), strict=True)
            force += c.stiffness * np.concatenate([viscosity.force(part) for viscosity, part in parts])
        return force

    def add_tangent(self, matrix: PETSc.Mat, v: Array, slope: Array, weight: float) -> None:
        """Add the derivative by the displacement (collective).

        v: present velocity [m/s]; slope: derivative of the weighted velocity by the displacement [1/s], both at owned
        dofs; weight: of the force at the end of the step in the balance.
        """
        columns = matrix.createVecRight()
        columns.array[:] = slope
        parts: list[tuple[float, PETSc.Mat]] = []
        if self._damping.mass:
            parts.append((self._damping.mass, self._structure.inertia.assemble_mass().copy()))
        if self._damping.stiffness:
            viscous = block_diagonal([viscosity.matrix() for viscosity in self._viscosities])
            parts.append((self._damping.stiffness, viscous))
        for coefficient, part in parts:
            part.diagonalScale(None, columns)
            matrix.axpy(coefficient, part, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        if not self.symmetric:
            split = zip(self._viscosities, self._structure.layout.split(v), strict=True)
            turning = block_diagonal([viscosity.turning(part) for viscosity, part in split])
            matrix.axpy(weight * self._damping.stiffness, turning, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
