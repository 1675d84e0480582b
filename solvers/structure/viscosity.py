"""Damping in proportion to the stiffness, as a viscous stress of one body.

    f = int C_0 : e(v) : e(w) dX,    e(v) = sym(R^T grad v)

times the coefficient [s], with the elasticity C_0 of the undeformed material and the rotation R in the middle of the
cell (docs/theory_structure.md, Time). The mixed element has the volume changes of whole cells. Here their part is
integrated by fewer points (selectively reduced integration), which does not lock either.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.structure import forms
from solvers.structure.materials import Material, Tensor

if TYPE_CHECKING:
    from solvers.structure.body import Body


class Viscosity:
    """Force and matrix of the viscous stress at the displacement of a body, for a coefficient of 1 s."""

    def __init__(self, body: Body):
        self._body, self._springs = body, body.spring_stiffness
        space, domain, dim = body.space, body.domain, body.domain.dim
        self._v, self._sum = fem.function(space), fem.function(space)
        scalars = fem.cellwise_space(domain)
        self._rotation = [[fem.function(scalars) for _ in range(dim)] for _ in range(dim)]
        for i in range(dim):
            self._rotation[i][i].x.array[:] = 1.0
        middle = fem.reference_nodes(domain).mean(axis=0, keepdims=True)
        self._gradient = fem.compile_expression(forms.deformation_gradient(body.u), middle)
        R = ufl.as_tensor(self._rotation)
        full = fem.volume_measure(domain, body.stiffness_degree)
        fewer = fem.volume_measure(domain, 2 * (domain.degree - 1))
        mu, whole, volume = _moduli(body.material, body.parameters, dim, mixed=body.formulation == "mixed")

        def power(a: Tensor, b: Tensor, factor: Tensor | float = 1.0) -> ufl.Form:
            """int C_0 : sym(a) : sym(b) dX."""
            both = ufl.tr(a) * ufl.tr(b)
            form = factor * (2 * mu * ufl.inner(ufl.sym(a), ufl.sym(b)) + whole * both) * full
            return form if volume is None else form + factor * volume * both * fewer

        w, dv, spin = ufl.TestFunction(space), ufl.TrialFunction(space), ufl.TrialFunction(scalars)
        of_v, of_w = R.T * ufl.grad(self._v), R.T * ufl.grad(w)
        wanted = [power(of_v, of_w), power(R.T * ufl.grad(dv), of_w)]
        if not body.linear:
            # R' = R W, W = sum_k spin_k E_k, and spin = (tr U 1 - U)^-1 (axial vector of A - A^T), A = R^T F'
            q, at_middle = ufl.TestFunction(scalars), fem.volume_measure(domain, 1)
            A, axes = R.T * ufl.grad(dv), _axes(dim)
            axial = [ufl.inner(ufl.as_matrix(E.tolist()), A) for E in axes]
            self._compliance = [[fem.function(scalars) for _ in axes] for _ in axes]
            wanted.append(q * at_middle)
            for E, row in zip(map(ufl.as_matrix, (axis.tolist() for axis in axes)), self._compliance, strict=True):
                wanted.append(-power(E * of_v, of_w, spin) - power(of_v, E * of_w, spin))
                wanted.append(q * sum(entry * a for entry, a in zip(row, axial, strict=True)) * at_middle)
        self._force, matrix, *turning = fem.compile_forms(wanted, f"damping of body '{body.name}'")
        self._matrix = _Assembled(matrix)
        self._turning = [_Turning(turning[k], turning[k + 1]) for k in range(1, len(turning), 2)]
        self._sizes = np.zeros(0)
        if turning:
            sizes = fem.function(scalars)
            fem.assemble_vector(turning[0], sizes.x.array)
            self._sizes = sizes.x.array[: scalars.dofmap.index_map.size_local].copy()

    def _turn(self) -> None:
        """Set the rotations of the cells."""
        if self._body.linear:
            return
        dim = self._body.dim
        F = fem.evaluate_cells(self._body.domain, self._gradient).reshape(-1, dim, dim)
        left, stretches, right = np.linalg.svd(F)
        U = right.transpose(0, 2, 1) * stretches[:, None, :] @ right
        trace = stretches.sum(axis=1)[:, None, None]
        compliance = np.linalg.inv(trace * np.eye(3) - U) if dim == 3 else 1.0 / trace
        for functions, values in ((self._rotation, left @ right), (self._compliance, compliance)):
            for i, row in enumerate(functions):
                for j, entry in enumerate(row):
                    entry.x.array[: len(F)] = values[:, i, j]
                    entry.x.scatter_forward()

    def _set(self, v: Array) -> None:
        self._turn()
        self._v.x.array[: self._body.size] = v
        self._v.x.scatter_forward()

    def force(self, v: Array) -> Array:
        """f of the velocity v [m/s] of owned dofs, with the springs of the body (collective)."""
        self._set(v)
        self._sum.x.array[:] = 0.0
        fem.assemble_vector(self._force, self._sum.x.array)
        fem.accumulate(self._sum)
        found = self._sum.x.array[: self._body.size].copy()
        return found if self._springs is None else found + self._springs.force(v)

    def matrix(self) -> PETSc.Mat:
        """Derivative of f by the velocity, until the next call (collective)."""
        self._turn()
        matrix = self._matrix.assemble()
        if self._springs is not None:
            matrix.axpy(1.0, self._springs.matrix, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        return matrix

    def turning(self, v: Array) -> PETSc.Mat:
        """Derivative of f by the displacement, which turns the cells, until the next call (collective).

        It is zero for small displacements.
        """
        if not self._turning:
            nothing = self._matrix.assemble()
            nothing.zeroEntries()
            return nothing
        self._set(v)
        total, *others = (turning.assemble(self._sizes) for turning in self._turning)
        for product in others:
            total.axpy(1.0, product, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        return total


class _Assembled:
    """The matrix of a bilinear form. Its pattern is made once."""

    def __init__(self, form: Any):
        self._form, self._matrix = form, fem.create_matrix(form)

    def assemble(self) -> PETSc.Mat:
        """The matrix, until the next call (collective)."""
        self._matrix.zeroEntries()
        fem.assemble_matrix(self._matrix, self._form)
        self._matrix.assemble()
        return self._matrix


class _Turning:
    """Derivative of f by the displacement through the rotations about one axis."""

    def __init__(self, by_spin: Any, spin: Any):
        self._by_spin, self._spin = _Assembled(by_spin), _Assembled(spin)
        self._product: PETSc.Mat | None = None

    def assemble(self, sizes: Array) -> PETSc.Mat:
        """(df / d spin) (d spin / du), until the next call; `sizes` of the cells (collective)."""
        spins = self._spin.assemble()
        scale = spins.createVecLeft()
        scale.array[:] = 1.0 / sizes
        spins.diagonalScale(scale, None)
        self._product = self._by_spin.assemble().matMult(spins, self._product)
        return self._product


def _axes(dim: int) -> list[Array]:
    """The matrices E_k with E_k a = e_k x a."""
    if dim == 2:
        return [np.array([[0.0, -1.0], [1.0, 0.0]])]
    return [np.cross(np.eye(3), axis) * -1.0 for axis in np.eye(3)]


def _moduli(
    material: Material, parameters: dict[str, Tensor], dim: int, *, mixed: bool
) -> tuple[Tensor, Tensor, Tensor | None]:
    """(mu, lambda, None), or (mu, lambda of the distortion, bulk modulus) [Pa], of the undeformed material."""
    F, J = ufl.variable(ufl.Identity(dim)), ufl.variable(ufl.as_ufl(1.0))
    energy = material.distortional(F, **parameters) if mixed else material.energy(F, **parameters)
    C = ufl.diff(ufl.diff(energy, F), F)
    mu, lmbda = C[0, 1, 0, 1], C[0, 0, 1, 1]
    if not mixed:
        return mu, lmbda, None
    return mu, lmbda, ufl.diff(ufl.diff(material.volumetric(J, **parameters), J), J)
