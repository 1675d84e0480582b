"""Hyperelastic materials: stored energies per reference volume [J/m^3] as functions of the deformation gradient F.

Parameters are numbers or functions of the reference position; `energy` receives them as UFL coefficients by name.
In 2D, F is 2x2: plane strain completes it with F_33 = 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Protocol, TypeAlias

import ufl

from solvers.api import Array

#: A field given by the user: value(x, t) with x of shape (3, n) [m] and t [s] -> shape (n,)
Value = Callable[[Array, float], Array]
Parameter = float | Value
Tensor: TypeAlias = Any  #: a UFL expression


class Material(Protocol):
    """What a body is made of."""

    #: the energy is one of two dimensions with S_33 = 0
    plane_stress: ClassVar[bool]

    @property
    def density(self) -> Parameter:
        """Reference density [kg/m^3]."""
        ...

    @property
    def energy(self) -> Callable[..., Tensor]:
        """Stored energy W(F, parameters by name)."""
        ...


def parameters(material: Material) -> dict[str, Parameter]:
    """The parameters of the energy by name."""
    return {f.name: getattr(material, f.name) for f in fields(material) if f.name != "density"}  # type: ignore[arg-type]


def in_space(F: Tensor) -> Tensor:
    """F in three dimensions: plane strain leaves the third direction undeformed."""
    if F.ufl_shape == (3, 3):
        return F
    return ufl.as_tensor([[F[0, 0], F[0, 1], 0], [F[1, 0], F[1, 1], 0], [0, 0, 1]])


def lame(E: float, nu: float) -> tuple[float, float]:
    """Lame parameters (mu, lambda) [Pa] from Young's modulus [Pa] and Poisson's ratio."""
    return E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


def plane_stress_lambda(mu: float, lmbda: float) -> float:
    """The lambda that makes the 2D St. Venant-Kirchhoff law one of plane stress (S_33 = 0)."""
    return 2.0 * lmbda * mu / (lmbda + 2.0 * mu)


@dataclass(frozen=True)
class StVenantKirchhoff:
    """W = lambda/2 (tr E)^2 + mu E:E with E = (F^T F - I)/2."""

    mu: Parameter
    lmbda: Parameter
    density: Parameter = 0.0
    plane_stress: ClassVar[bool] = False

    def energy(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        E = (F.T * F - ufl.Identity(F.ufl_shape[0])) / 2
        return lmbda / 2 * ufl.tr(E) ** 2 + mu * ufl.inner(E, E)


@dataclass(frozen=True)
class PlaneStressStVenantKirchhoff(StVenantKirchhoff):
    """The same energy in two dimensions with the lambda of `plane_stress_lambda`."""

    plane_stress: ClassVar[bool] = True


@dataclass(frozen=True)
class NeoHooke:
    """W = mu/2 (I_1 - 3) - mu ln J + lambda/2 (ln J)^2.

    Source: Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis (2008), eq. 6.27.
    """

    mu: Parameter
    lmbda: Parameter
    density: Parameter = 0.0
    plane_stress: ClassVar[bool] = False

    def energy(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        J, I1 = ufl.det(F), ufl.tr(in_space(F).T * in_space(F))
        return mu / 2 * (I1 - 3) - mu * ufl.ln(J) + lmbda / 2 * ufl.ln(J) ** 2


@dataclass(frozen=True)
class CoupNeoHooke:
    """W = c/beta (J^(-2 beta) - 1) + c (I_1 - 3), c = mu/2, beta = lambda/(2 mu) = nu/(1 - 2 nu).

    The compressible neo-Hooke law of the code 4C and its predecessors. With L = ln J the first term is
    -2 c L (1 - beta L + 2/3 (beta L)^2 - ...): below beta = 1e-4 this sum loses less to what it leaves out than the
    formula to rounding, and nu = 0 is no special case.
    """

    mu: Parameter
    lmbda: Parameter
    density: Parameter = 0.0
    plane_stress: ClassVar[bool] = False

    def energy(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        J, I1 = ufl.det(F), ufl.tr(in_space(F).T * in_space(F))
        c, beta, L = mu / 2, lmbda / (2 * mu), ufl.ln(J)
        small = -2 * L * (1 - beta * L + 2 / 3 * (beta * L) ** 2)
        volumetric = ufl.conditional(ufl.lt(beta, 1e-4), small, (ufl.exp(-2 * beta * L) - 1) / beta)
        return c * volumetric + c * (I1 - 3)


@dataclass(frozen=True)
class MooneyRivlin:
    """W = c10 (J^(-2/3) I_1 - 3) + c01 (J^(-4/3) I_2 - 3) + bulk/2 (J - 1)^2.

    Source: Bonet & Wood (2008), section 6.5; shear modulus 2 (c10 + c01).
    """

    c10: Parameter
    c01: Parameter
    bulk: Parameter
    density: Parameter = 0.0
    plane_stress: ClassVar[bool] = False

    def energy(self, F: Tensor, c10: Tensor, c01: Tensor, bulk: Tensor) -> Tensor:
        C = in_space(F).T * in_space(F)
        J, I1 = ufl.det(F), ufl.tr(C)
        I2 = (I1**2 - ufl.tr(C * C)) / 2
        scale = ufl.exp(-2 / 3 * ufl.ln(J))
        return c10 * (scale * I1 - 3) + c01 * (scale**2 * I2 - 3) + bulk / 2 * (J - 1) ** 2
