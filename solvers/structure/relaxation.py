"""Viscoelasticity: stresses that relax, as a Prony series of the distortional stress, at any deformation.

    S = S_element + sum_i H_i,    dH_i/dt + H_i / tau_i = b_i dS_D/dt,    b_i = g_i / (1 - sum g)

with the second Piola-Kirchhoff stress S_D = 2 dD/dC of the law without its part U(J), whose constants are those after a
long time, and the shares g of the stress at once that relax with the times tau. S_D is linear in time within a step,
and the solution of that is exact: with x = dt / tau, e = exp(-x) and a = (1 - e) / x

    H_{n+1} = e H_n + a b (S_{n+1} - S_n).

In a step this is the stress of an energy, so that tangents are symmetric. The state is q = b S_D - H, which no sudden
deformation changes.
Source: Simo, Computer Methods in Applied Mechanics and Engineering 60 (1987) 153-173; Holzapfel, Nonlinear Solid
Mechanics (2000), section 6.10. The factor a is that of Taylor, Pister & Goudreau, Int. J. Numer. Methods Engrg. 2
(1970) 45-59.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array, State
from solvers.mesh.distributed import Nodal
from solvers.structure import forms
from solvers.structure.element import Element
from solvers.structure.elements import by_cells
from solvers.structure.materials import Tensor, in_space


@dataclass(frozen=True)
class Branch:
    """A part of the distortional stress that relaxes."""

    share: float  #: of the stress at once
    time: float  #: [s]


class Relaxing:
    """An element whose distortional stress relaxes in branches."""

    def __init__(
        self, element: Element, domain: fem.Domain, u: Tensor, parameters: dict[str, Tensor], degree: int,
        branches: Sequence[Branch],
    ):  # fmt: skip
        """degree: of the quadrature rule that integrates the element."""
        self._element, self._domain, self._parameters, self._degree = element, domain, parameters, degree
        self.material = element.material
        long_term = 1.0 - sum(branch.share for branch in branches)
        self._b = np.array([branch.share for branch in branches]) / long_term
        self._times = np.array([branch.time for branch in branches])
        self._factor = fem.constant(domain, 0.0)  #: sum of a b
        space = fem.quadrature_space(domain, degree, (3, 3))
        self._history = fem.function(space)  #: the stress in this step besides the factor times S_D [Pa]
        self._blocks = fem.cell_blocks(space)[: fem.owned_cells(domain)]
        #: q of each branch at the points of the owned cells [Pa], shape (branches, cells, points, 3, 3);
        #: None before the first step, when all stresses have relaxed
        self._q: Array | None = None
        points, _ = fem.quadrature_points(domain, degree)
        F = ufl.variable(in_space(forms.deformation_gradient(u)))
        self._gradient = fem.compile_expression(F, points)
        self._distortion = fem.compile_expression(ufl.diff(self.material.distortional(F, **parameters), F), points)
        [of_cells] = fem.cell_quadrature(domain, u.function_space, degree)
        self._weights = of_cells.weights
        self._cells = fem.input_cells(domain)[: len(self._blocks)]  #: their numbers in the mesh file
        self._decay, self._mean = np.ones(len(self._b)), np.ones(len(self._b))
        self._fit: tuple[Any, Any, Array, Array] | None = None  #: see `_assemble_fit`
        self._start: tuple[Array, Array, Array] | None = None  #: S_D [Pa], strain and q [Pa] at the start of the step

    def energy(self, F: Tensor) -> Tensor:
        """That after a long time."""
        return self._element.energy(F)

    def potential(self, F: Tensor) -> Tensor:
        return self._element.potential(F) + self._viscous(F, self._history)

    def tangent_potential(self, F: Tensor) -> Tensor:
        return self._element.tangent_potential(F) + self._viscous(F, self._history)

    def smooth_potential(self, F: Tensor) -> Tensor:
        return self._element.smooth_potential(F) + self._viscous(F, ufl.as_tensor(self._smooth))

    def _viscous(self, F: Tensor, history: Tensor) -> Tensor:
        F = in_space(F)
        strain = ufl.sym(F) if self.material.linear else F.T * F / 2
        return self._factor * self.material.distortional(F, **self._parameters) + ufl.inner(history, strain)

    def begin_step(self, dt: float) -> None:
        self._element.begin_step(dt)
        x = dt / self._times
        self._decay, self._mean = np.exp(-x), -np.expm1(-x) / x
        S, E = self._stress_and_strain()
        q = _each(self._b) * S if self._q is None else self._q
        self._start = S, E, q
        self._set(self._mean, (self._b * (self._decay - self._mean)).sum() * S - (_each(self._decay) * q).sum(axis=0))

    def end_step(self) -> float:
        lost = self._element.end_step()
        assert self._start is not None
        (S, E, q), (S_now, E_now) = self._start, self._stress_and_strain()
        before = self._b.sum() * S - q.sum(axis=0)
        b, decay, mean = (_each(one) for one in (self._b, self._decay, self._mean))
        self._q = decay * q + b * ((1.0 - mean) * S_now + (mean - decay) * S)
        after = self._b.sum() * S_now - self._q.sum(axis=0)
        work = np.einsum("cp,cpij,cpij->", self._weights, 0.5 * (before + after), E_now - E)
        self._rest(self._q)
        return lost + float(self._domain.comm.allreduce(work))

    def _rest(self, q: Array) -> None:
        """Between steps: what happens happens at once."""
        self._set(np.ones(len(self._b)), -q.sum(axis=0))

    def _set(self, mean: Array, history: Array) -> None:
        self._factor.value = self._b @ mean
        self._history.x.array.reshape(-1, 9)[self._blocks] = history.reshape(*self._blocks.shape, 9)

    def _stress_and_strain(self) -> tuple[Array, Array]:
        """S_D [Pa] and the strain at the present displacement, shape (cells, points, 3, 3)."""
        shape = (*self._blocks.shape, 3, 3)
        F, P = (fem.evaluate_cells(self._domain, one).reshape(shape) for one in (self._gradient, self._distortion))
        turned = F.swapaxes(2, 3)
        if self.material.linear:
            return P, 0.5 * (F + turned) - np.eye(3)
        return np.linalg.solve(F, P), 0.5 * (turned @ F - np.eye(3))

    def update(self) -> None:
        self._element.update()

    def linearise(self) -> None:
        self._element.linearise()

    def complete_tangent(self, matrix: PETSc.Mat) -> None:
        self._element.complete_tangent(matrix)

    # ------------------------------------------------------------------------------------------------- output

    @cached_property
    def _smooth(self) -> list[list[Any]]:
        """`_history` as polynomials in each cell, its mean square error being least."""
        space = fem.pressure_space(self._domain)
        by_entry = {(i, j): fem.function(space) for i in range(3) for j in range(i, 3)}
        return [[by_entry[min(i, j), max(i, j)] for j in range(3)] for i in range(3)]

    def _assemble_fit(self) -> tuple[Any, Any, Array, Array]:
        """An entry at the points, the form of its right-hand side, unknowns of the cells, and inverse mass matrices."""
        if self._fit is None:
            space = self._smooth[0][0].function_space
            dx = fem.volume_measure(self._domain, self._degree)
            q, r = ufl.TestFunction(space), ufl.TrialFunction(space)
            entry = fem.function(fem.quadrature_space(self._domain, self._degree))
            mass, cells = fem.compile_form(q * r * dx), np.sort(fem.cell_blocks(space)[: len(self._blocks)], axis=1)
            inverse = np.linalg.inv(by_cells(fem.create_matrix(mass), mass, cells))
            self._fit = entry, fem.compile_form(entry * q * dx), cells, inverse
        return self._fit

    def prepare_output(self) -> None:
        self._element.prepare_output()
        entry, right, cells, inverse_mass = self._assemble_fit()
        blocks = fem.cell_blocks(entry.function_space)[: len(self._blocks)]
        history = self._history.x.array.reshape(-1, 3, 3)[self._blocks]
        for i in range(3):
            for j in range(i, 3):
                entry.x.array[blocks] = history[:, :, i, j]
                found = self._smooth[i][j]
                found.x.array[:] = 0.0
                fem.assemble_vector(right, found.x.array)
                found.x.array[cells] = np.einsum("cij,cj->ci", inverse_mass, found.x.array[cells])
                found.x.scatter_forward()

    # ------------------------------------------------------------------------------------------ save and restore

    def save(self) -> State:
        if self._q is None:
            return {}
        return {str(i): Nodal(q.reshape(len(q), -1), self._cells) for i, q in enumerate(self._q)}

    def restore(self, state: State) -> None:
        """The state may be that of other branches: what is new has relaxed. Values may be those of all cells."""
        if not state:
            self._q, self._factor.value = None, 0.0
            self._history.x.array[:] = 0.0
            return
        self._q = _each(self._b) * self._stress_and_strain()[0]
        for i, q in enumerate(self._q):
            if (saved := state.get(str(i))) is not None:
                values = saved.values if isinstance(saved, Nodal) else saved[self._cells]
                q[:] = values.reshape(q.shape)
        self._rest(self._q)


def _each(factors: Array) -> Array:
    """Factors of the branches, for products with q."""
    return factors[:, None, None, None, None]
