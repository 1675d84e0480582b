"""Conversions between the elastic constants of isotropic materials.

Arguments are numbers or arrays of the same shape. Source: Bonet & Wood, Nonlinear Continuum Mechanics for Finite
Element Analysis (2008), section 6.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T", float, NDArray[np.float64])


def lame(E: T, nu: T) -> tuple[T, T]:
    """(mu, lambda) [Pa] from Young's modulus [Pa] and Poisson's ratio."""
    return E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


def plane_stress_lambda(mu: T, lmbda: T) -> T:
    """The lambda that makes the 2D St. Venant-Kirchhoff law one of plane stress (S_33 = 0)."""
    return 2.0 * lmbda * mu / (lmbda + 2.0 * mu)


def shear(E: T, nu: T) -> T:
    """The shear modulus mu [Pa] from Young's modulus [Pa] and Poisson's ratio."""
    return E / (2.0 * (1.0 + nu))


def lambda_of_poisson(mu: T, nu: T) -> T:
    """lambda [Pa] from the shear modulus and Poisson's ratio."""
    return 2.0 * mu * nu / (1.0 - 2.0 * nu)


def lambda_of_bulk(mu: T, bulk: T) -> T:
    """lambda [Pa] from the shear and the bulk modulus [Pa]."""
    return bulk - 2.0 * mu / 3.0


def young(mu: T, lmbda: T) -> T:
    """Young's modulus [Pa]."""
    return mu * (3.0 * lmbda + 2.0 * mu) / (lmbda + mu)


def poisson(mu: T, lmbda: T) -> T:
    """Poisson's ratio."""
    return lmbda / (2.0 * (lmbda + mu))
