"""Hyperelastic materials: stored energies per reference volume [J/m^3] as functions of the deformation gradient F.

Values are numbers or functions of the reference position; `energy` receives them as UFL coefficients by name.
In 2D, F is 2x2: plane strain completes it with F_33 = 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Protocol, TypeAlias

import ufl

from solvers.values import Value

Tensor: TypeAlias = Any  #: a UFL expression


class Material(Protocol):
    """What a body is made of."""

    #: the energy is one of two dimensions with S_33 = 0
    plane_stress: ClassVar[bool]
    #: the energy is one of small displacements: a function of sym(F) - I that does not tell rotation from strain
    linear: ClassVar[bool]

    @property
    def density(self) -> Value:
        """Reference density [kg/m^3]."""
        ...

    @property
    def energy(self) -> Callable[..., Tensor]:
        """Stored energy W(F, parameters by name)."""
        ...

    def volume_ratio(self, F: Tensor) -> Tensor:
        """J = det F, or the law's own measure of it: 1 + tr of its strain."""
        ...

    @property
    def volumetric(self) -> Callable[..., Tensor]:
        """Its part of a pure change of volume: U(J, parameters by name) = W(F) where F = s I has this J."""
        ...

    @property
    def distortional(self) -> Callable[..., Tensor]:
        """The rest of it, W(F) - U(J)."""
        ...


def parameters(material: Material) -> dict[str, Value]:
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

    mu: Value
    lmbda: Value
    density: Value = 0.0
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    def strain(self, F: Tensor) -> Tensor:
        return (F.T * F - ufl.Identity(F.ufl_shape[0])) / 2

    def energy(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        E = self.strain(F)
        return lmbda / 2 * ufl.tr(E) ** 2 + mu * ufl.inner(E, E)

    def volume_ratio(self, F: Tensor) -> Tensor:
        return 1 + ufl.tr(self.strain(F))

    def volumetric(self, J: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        return (lmbda / 2 + mu / 3) * (J - 1) ** 2

    def distortional(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        E = self.strain(F)
        return mu * (ufl.inner(E, E) - ufl.tr(E) ** 2 / 3)


@dataclass(frozen=True)
class PlaneStressStVenantKirchhoff(StVenantKirchhoff):
    """The same energy in two dimensions with the lambda of `plane_stress_lambda`."""

    plane_stress: ClassVar[bool] = True


@dataclass(frozen=True)
class LinearElastic(StVenantKirchhoff):
    """The same energy of the strain e = sym(grad u) of small displacements (Hooke's law)."""

    linear: ClassVar[bool] = True

    def strain(self, F: Tensor) -> Tensor:
        return ufl.sym(F) - ufl.Identity(F.ufl_shape[0])


@dataclass(frozen=True)
class PlaneStressLinearElastic(LinearElastic):
    """The same energy in two dimensions with the lambda of `plane_stress_lambda`."""

    plane_stress: ClassVar[bool] = True


#: Below this exponent `_inverse_power` is a series: what it leaves out is less than 1e-14 of it for J from 0.01 to 100.
_SMALL = 1e-3


def _inverse_power(J: Tensor, n: Tensor) -> Tensor:
    """(J^-n - 1)/n, for small n >= 0 by its series about the limit -ln J."""
    x = -n * ufl.ln(J)
    series = -ufl.ln(J) * (1 + x / 2 * (1 + x / 3 * (1 + x / 4 * (1 + x / 5))))
    return ufl.conditional(ufl.lt(n, _SMALL), series, (ufl.exp(x) - 1) / ufl.max_value(n, _SMALL))


def _cube_root(J: Tensor) -> Tensor:
    return ufl.exp(ufl.ln(J) / 3)


def _neo_hooke_distortion(F: Tensor, mu: Tensor) -> Tensor:
    """mu/2 (I_1 - 3 J^(2/3))."""
    return mu / 2 * (ufl.tr(in_space(F).T * in_space(F)) - 3 * _cube_root(ufl.det(F)) ** 2)


@dataclass(frozen=True)
class NeoHooke:
    """W = mu/2 (I_1 - 3) - mu ln J + lambda/2 (ln J)^2.

    Source: Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis (2008), eq. 6.27.
    """

    mu: Value
    lmbda: Value
    density: Value = 0.0
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    def energy(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        J, I1 = ufl.det(F), ufl.tr(in_space(F).T * in_space(F))
        return mu / 2 * (I1 - 3) - mu * ufl.ln(J) + lmbda / 2 * ufl.ln(J) ** 2

    def volume_ratio(self, F: Tensor) -> Tensor:
        return ufl.det(F)

    def volumetric(self, J: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        return 3 * mu / 2 * (_cube_root(J) ** 2 - 1) - mu * ufl.ln(J) + lmbda / 2 * ufl.ln(J) ** 2

    def distortional(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        return _neo_hooke_distortion(F, mu)


@dataclass(frozen=True)
class CoupNeoHooke:
    """W = c/beta (J^(-2 beta) - 1) + c (I_1 - 3), c = mu/2, beta = lambda/(2 mu) = nu/(1 - 2 nu) >= 0.

    The compressible neo-Hooke law of the code 4C and its predecessors. For nu = 0 the first term is its limit -mu ln J.
    """

    mu: Value
    lmbda: Value
    density: Value = 0.0
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    def energy(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        J, I1 = ufl.det(F), ufl.tr(in_space(F).T * in_space(F))
        return mu * _inverse_power(J, lmbda / mu) + mu / 2 * (I1 - 3)

    def volume_ratio(self, F: Tensor) -> Tensor:
        return ufl.det(F)

    def volumetric(self, J: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        return mu * _inverse_power(J, lmbda / mu) + 3 * mu / 2 * (_cube_root(J) ** 2 - 1)

    def distortional(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        return _neo_hooke_distortion(F, mu)


@dataclass(frozen=True)
class MooneyRivlin:
    """W = c10 (J^(-2/3) I_1 - 3) + c01 (J^(-4/3) I_2 - 3) + bulk/2 (J - 1)^2.

    Source: Bonet & Wood (2008), section 6.5; shear modulus 2 (c10 + c01).
    """

    c10: Value
    c01: Value
    bulk: Value
    density: Value = 0.0
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    def energy(self, F: Tensor, c10: Tensor, c01: Tensor, bulk: Tensor) -> Tensor:
        return self.distortional(F, c10, c01, bulk) + self.volumetric(ufl.det(F), c10, c01, bulk)

    def volume_ratio(self, F: Tensor) -> Tensor:
        return ufl.det(F)

    def volumetric(self, J: Tensor, c10: Tensor, c01: Tensor, bulk: Tensor) -> Tensor:
        return bulk / 2 * (J - 1) ** 2

    def distortional(self, F: Tensor, c10: Tensor, c01: Tensor, bulk: Tensor) -> Tensor:
        C = in_space(F).T * in_space(F)
        J, I1 = ufl.det(F), ufl.tr(C)
        I2 = (I1**2 - ufl.tr(C * C)) / 2
        scale = ufl.exp(-2 / 3 * ufl.ln(J))
        return c10 * (scale * I1 - 3) + c01 * (scale**2 * I2 - 3)
