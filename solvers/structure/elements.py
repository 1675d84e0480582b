"""Elements: `Displacement` and `Mixed`, by which the energy of a body is integrated over cells.

The displacement element locks for nearly incompressible materials: each quadrature point then requires det F = 1. The
mixed element has fewer conditions. In both, the nodal displacements are the only unknowns.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import ufl
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array, State
from solvers.structure import forms
from solvers.structure.materials import Material, Tensor

Formulation = Literal["displacement", "mixed"]


class Displacement:
    """The displacement element, with the energy W(F)."""

    def __init__(self, material: Material, parameters: dict[str, Tensor]):
        self.material, self.parameters = material, parameters

    def energy(self, F: Tensor) -> Tensor:
        return self.material.energy(F, **self.parameters)

    potential = tangent_potential = smooth_potential = energy

    def begin_step(self, dt: float) -> None:
        pass

    def end_step(self) -> float:
        return 0.0

    def update(self) -> None:
        pass

    def linearise(self) -> None:
        pass

    def complete_tangent(self, matrix: PETSc.Mat) -> None:
        pass

    def prepare_output(self) -> None:
        pass

    def save(self) -> State:
        return {}

    def restore(self, state: State) -> None:
        pass


class Mixed:
    """Mixed element with discontinuous volume ratio theta and pressure p, eliminated cell by cell (Hu-Washizu).

    theta, p and their test functions q are constant in first-order cells and linear in second-order ones. With J and
    W(F) = D(F) + U(J) as in docs/theory_structure.md, Elements,

        int theta q dX = int J q dX,   int p q dX = int U'(theta) q dX,

    and the tangent is the second derivative of int D(F) + p J dX at fixed p and one product per cell:

        B^T M^-1 C M^-1 B,   q^T B du = int q dJ/du . du dX,   M = int q r dX,   C = int U''(theta) q r dX.

    p in the tangent is that of the last iterate plus its linear change.
    Source: Simo, Taylor & Pister, Computer Methods in Applied Mechanics and Engineering 51 (1985) 177-208; Bonet &
    Wood, Nonlinear Continuum Mechanics for Finite Element Analysis (2008), section 8.6.5 (mean dilatation).
    """

    def __init__(
        self, domain: fem.Domain, u: Tensor, material: Material, parameters: dict[str, Tensor], dx: ufl.Measure
    ):
        self.material, self.parameters = material, parameters
        space = fem.pressure_space(domain)
        self._u, self._ratio, self._pressure = u, fem.function(space), fem.function(space)
        self._tangent_pressure = fem.function(space)
        q, r, du = ufl.TestFunction(space), ufl.TrialFunction(space), ufl.TrialFunction(u.function_space)
        theta = ufl.variable(self._ratio)
        self._volumetric = material.volumetric(theta, **parameters)
        pressure = ufl.diff(self._volumetric, theta)
        J = material.volume_ratio(forms.deformation_gradient(u))
        self._ratio_right = fem.compile_form(J * q * dx)
        self._pressure_right = fem.compile_form(pressure * q * dx)
        self._modulus = fem.compile_form(ufl.diff(pressure, theta) * q * r * dx)
        self._change = fem.compile_form(q * ufl.derivative(J, u, du) * dx)
        #: owned unknowns of q in each cell, as the columns of a matrix are ordered
        self._cells = np.sort(fem.cell_blocks(space)[: fem.owned_cells(domain)], axis=1)
        mass = fem.compile_form(q * r * dx)
        self._inverse_mass = np.linalg.inv(by_cells(fem.create_matrix(mass), mass, self._cells))
        self._C, self._B = fem.create_matrix(self._modulus), fem.create_matrix(self._change)
        self._CB: PETSc.Mat | None = None
        self._BCB: PETSc.Mat | None = None
        #: displacement and pressure of the last tangent of the step
        self._last: tuple[Array, Array] | None = None

    def energy(self, F: Tensor) -> Tensor:
        return self.material.distortional(F, **self.parameters) + self._volumetric

    def potential(self, F: Tensor) -> Tensor:
        return self.material.distortional(F, **self.parameters) + self._pressure * self.material.volume_ratio(F)

    smooth_potential = potential

    def tangent_potential(self, F: Tensor) -> Tensor:
        distortion = self.material.distortional(F, **self.parameters)
        return distortion + self._tangent_pressure * self.material.volume_ratio(F)

    def begin_step(self, dt: float) -> None:
        self._last = None

    def end_step(self) -> float:
        return 0.0

    def update(self) -> None:
        for function, right in ((self._ratio, self._ratio_right), (self._pressure, self._pressure_right)):
            function.x.array[:] = 0.0
            fem.assemble_vector(right, function.x.array)
            function.x.array[self._cells] = np.einsum("cij,cj->ci", self._inverse_mass, function.x.array[self._cells])
            function.x.scatter_forward()

    def linearise(self) -> None:
        present = self._pressure.x.array.copy()
        self._tangent_pressure.x.array[:] = present
        if self._last is not None and self._CB is not None:
            u, p = self._last
            change, result = self._CB.createVecs()
            change.array[:] = (self._u.x.array - u)[: change.local_size]
            self._CB.mult(change, result)
            self._tangent_pressure.x.array[: result.local_size] = p[: result.local_size] + result.array
            self._tangent_pressure.x.scatter_forward()
        self._last = self._u.x.array.copy(), present
        self._multiply()

    def _multiply(self) -> None:
        """M^-1 C M^-1 B and B^T M^-1 C M^-1 B."""
        C = self._inverse_mass @ by_cells(self._C, self._modulus, self._cells) @ self._inverse_mass
        rows = np.empty((self._cells.size, self._cells.shape[1]))
        rows[self._cells] = C
        indptr, indices, _ = self._C.getValuesCSR()
        self._C.setValuesCSR(indptr, indices, rows.ravel())
        self._C.assemble()
        _assemble(self._B, self._change)
        self._CB = self._C.matMult(self._B, result=self._CB)
        self._BCB = self._B.transposeMatMult(self._CB, result=self._BCB)

    def complete_tangent(self, matrix: PETSc.Mat) -> None:
        """The sparsity of B^T C B is that of the tangent."""
        matrix.axpy(1.0, self._BCB, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)

    def prepare_output(self) -> None:
        pass

    def save(self) -> State:
        return {}

    def restore(self, state: State) -> None:
        pass


def by_cells(matrix: PETSc.Mat, form: Any, cells: NDArray[np.int32]) -> Array:
    """A form of discontinuous functions by cells, shape (cells, n, n); it is assembled into `matrix`.

    cells: owned unknowns of each cell in ascending order, shape (cells, n).
    """
    _assemble(matrix, form)
    return matrix.getValuesCSR()[2].reshape(-1, cells.shape[1])[cells]  # type: ignore[no-any-return]


def _assemble(matrix: PETSc.Mat, form: Any) -> None:
    matrix.zeroEntries()
    fem.assemble_matrix(matrix, form)
    matrix.assemble()
