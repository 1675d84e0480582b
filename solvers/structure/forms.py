"""Weak forms of a body in its reference configuration (docs/theory_structure.md); its loads are in `loads`."""

from __future__ import annotations

from collections.abc import Sequence

import ufl

from solvers.structure.active import ActiveStress
from solvers.structure.element import Element
from solvers.structure.materials import Tensor, in_space


def deformation_gradient(u: Tensor) -> Tensor:
    """F = I + grad u."""
    return ufl.Identity(len(u)) + ufl.grad(u)


def stored_energy(u: Tensor, element: Element, dx: ufl.Measure) -> ufl.Form:
    """int W(F) dX [J]."""
    return element.energy(deformation_gradient(u)) * dx


def internal_force(u: Tensor, element: Element, v: Tensor, dx: ufl.Measure) -> ufl.Form:
    """int P : grad v dX."""
    return ufl.derivative(element.potential(deformation_gradient(u)) * dx, u, v)


def tangent(u: Tensor, element: Element, v: Tensor, du: Tensor, dx: ufl.Measure) -> ufl.Form:
    """Derivative of `internal_force` in u, except for the term that the element adds to the assembled matrix."""
    energy = element.tangent_potential(deformation_gradient(u)) * dx
    return ufl.derivative(ufl.derivative(energy, u, v), u, du)


def first_piola_kirchhoff(u: Tensor, element: Element, active: Sequence[ActiveStress] = ()) -> Tensor:
    """P = dW/dF [Pa], at any point after `element.prepare_output()`."""
    F = ufl.variable(deformation_gradient(u))
    return ufl.diff(_smooth(F, element, active), F)


def _smooth(F: Tensor, element: Element, active: Sequence[ActiveStress]) -> Tensor:
    return element.smooth_potential(F) + sum(one.potential(F, linear=element.material.linear) for one in active)


def inertia(a: Tensor, v: Tensor, rho: Tensor, dx: ufl.Measure) -> ufl.Form:
    """int rho a.v dX."""
    return rho * ufl.inner(a, v) * dx


def cauchy_stress(u: Tensor, element: Element, active: Sequence[ActiveStress] = ()) -> Tensor:
    """sigma = P F^T / J [Pa], shape (3, 3) also in 2D: sigma_33 is zero in plane stress, else that of F_33 = 1.

    For small displacements sigma = P.
    """
    material, F = element.material, deformation_gradient(u)
    F = ufl.variable(F if material.plane_stress else in_space(F))
    P = ufl.diff(_smooth(F, element, active), F)
    sigma = P if material.linear else P * F.T / ufl.det(F)
    if sigma.ufl_shape == (3, 3):
        return sigma
    return ufl.as_tensor([[sigma[0, 0], sigma[0, 1], 0], [sigma[1, 0], sigma[1, 1], 0], [0, 0, 0]])
