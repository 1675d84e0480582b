"""Laws by principal stretches in an element: their energy as its second-order expansion at quadrature points,

    W(F) = W_0 + P_0 : (F - F_0) + 1/2 (F - F_0) : A_0 : (F - F_0),

about the present deformation F_0, where it has the value, stress and tangent of the law. So weak forms stay those of
all laws. At other points, for output, the stress is interpolated from the nodes of each cell, where it is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import ufl
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array, State
from solvers.structure.element import Element
from solvers.structure.materials import Ogden, Tensor, in_space
from solvers.structure.materials.ogden import Spectral, at_gradients, tangent
from solvers.values import Value


@dataclass(frozen=True)
class Expanded:
    """A law whose distortional energy is an expansion with coefficients at points."""

    law: Ogden
    dim: int
    energy_here: Tensor  #: W_0 [J/m^3]
    gradient: Tensor  #: F_0, shape (3, 3)
    stress: Tensor  #: P_0 [Pa], shape (3, 3)
    slope: Tensor  #: A_0 [Pa], entries of a tensor in `dim` dimensions by rows, shape (dim^2, dim^2)
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    @property
    def density(self) -> Value:
        return self.law.density

    def energy(self, F: Tensor, **constants: Tensor) -> Tensor:
        return self.distortional(F, **constants) + self.volumetric(ufl.det(F), **constants)

    def volume_ratio(self, F: Tensor) -> Tensor:
        return self.law.volume_ratio(F)

    def volumetric(self, J: Tensor, **constants: Tensor) -> Tensor:
        return self.law.volumetric(J, **constants)

    def distortional(self, F: Tensor, **constants: Tensor) -> Tensor:
        change = in_space(F) - self.gradient
        entries = ufl.as_vector([change[i, j] for i in range(self.dim) for j in range(self.dim)])
        return self.energy_here + ufl.inner(self.stress, change) + ufl.dot(entries, self.slope * entries) / 2


class PrincipalStretches:
    """Coefficients of an `Expanded` law for the present displacement of a body."""

    def __init__(self, domain: fem.Domain, law: Ogden, F: Tensor, degree: int):
        """F: that of the law, an expression of the displacement; degree: of the quadrature rule."""
        self._domain, dim = domain, domain.dim
        spaces = [fem.quadrature_space(domain, degree, shape) for shape in ((), (3, 3), (3, 3), (dim**2, dim**2))]
        self._fields = tuple(fem.function(space) for space in spaces)
        self.law = Expanded(law, dim, *self._fields)
        owned = fem.owned_cells(domain)
        self._blocks = [fem.cell_blocks(space)[:owned] for space in spaces]
        points, _ = fem.quadrature_points(domain, degree)
        self._gradient = fem.compile_expression(in_space(F), points)
        self._terms = law.moduli(fem.cell_midpoints(domain)[:, :owned])
        self._present: Spectral | None = None
        self._nodal_stress: tuple[list[Any], Any] | None = None
        self._F = F
        self.update()

    def _at(self, expression: Any, points: int) -> tuple[Array, Spectral]:
        """F at the points of an expression in all owned cells, shape (cells times points, 3, 3), and the law there."""
        F = fem.evaluate_cells(self._domain, expression).reshape(-1, 3, 3)
        return F, at_gradients(F, self._terms_at(points))

    def _terms_at(self, points: int) -> list[tuple[Array, float]]:
        """Those of all points in cells of so many points."""
        return [(np.repeat(modulus, points), exponent) for modulus, exponent in self._terms]

    def update(self) -> None:
        """Energy and stress at the present displacement."""
        F, self._present = self._at(self._gradient, self._blocks[0].shape[1])
        for k, values in enumerate((self._present.energy, F, self._present.stress)):
            self._write(k, values)

    def linearise(self) -> None:
        """The tangent there."""
        assert self._present is not None
        self._write(3, tangent(self._present, self._terms_at(self._blocks[0].shape[1]), self._domain.dim))

    def _write(self, k: int, values: Array) -> None:
        blocks, field = self._blocks[k], self._fields[k]
        size = int(np.prod(field.ufl_shape))
        field.x.array.reshape(-1, size)[blocks] = values.reshape(*blocks.shape, size)

    def without_tangent(self, expression: Tensor) -> Tensor:
        """An expression of the law whose first derivative is to be taken."""
        slope = self._fields[3]
        return ufl.replace(expression, {slope: ufl.zero(slope.ufl_shape)})

    def at_any_point(self, expression: Tensor) -> Tensor:
        """The same with the stress interpolated from nodes, after `prepare_output`."""
        stress = ufl.as_tensor(np.reshape(self._create_nodal_stress()[0], (3, 3)).tolist())
        return ufl.replace(self.without_tangent(expression), {self._fields[2]: stress})

    def _create_nodal_stress(self) -> tuple[list[Any], Any]:
        """Entries of the stress by rows, as polynomials in each cell, and F at their nodes; once."""
        if self._nodal_stress is None:
            space, nodes = fem.broken_space(self._domain), fem.reference_nodes(self._domain)
            entries = [fem.function(space) for _ in range(9)]
            self._nodal_stress = entries, fem.compile_expression(in_space(self._F), nodes)
        return self._nodal_stress

    def prepare_output(self) -> None:
        """The stress at the nodes of all cells."""
        entries, gradient = self._create_nodal_stress()
        blocks = fem.cell_blocks(entries[0].function_space)[: len(self._blocks[0])]
        _, found = self._at(gradient, blocks.shape[1])
        for entry, values in zip(entries, found.stress.reshape(-1, 9).T, strict=True):
            entry.x.array[blocks] = values.reshape(blocks.shape)


class ByPrincipalStretches:
    """An element of such a law."""

    def __init__(self, element: Element, stretches: PrincipalStretches):
        self._element, self._stretches, self.material = element, stretches, element.material

    def energy(self, F: Tensor) -> Tensor:
        return self._stretches.without_tangent(self._element.energy(F))

    def potential(self, F: Tensor) -> Tensor:
        return self._stretches.without_tangent(self._element.potential(F))

    def tangent_potential(self, F: Tensor) -> Tensor:
        return self._element.tangent_potential(F)

    def smooth_potential(self, F: Tensor) -> Tensor:
        return self._stretches.at_any_point(self._element.smooth_potential(F))

    def begin_step(self, dt: float) -> None:
        self._element.begin_step(dt)

    def end_step(self) -> float:
        return self._element.end_step()

    def update(self) -> None:
        self._stretches.update()
        self._element.update()

    def linearise(self) -> None:
        self._stretches.linearise()
        self._element.linearise()

    def complete_tangent(self, matrix: PETSc.Mat) -> None:
        self._element.complete_tangent(matrix)

    def prepare_output(self) -> None:
        self._stretches.prepare_output()
        self._element.prepare_output()

    def save(self) -> State:
        return self._element.save()

    def restore(self, state: State) -> None:
        self._element.restore(state)
