"""Ogden's law for rubber: powers of the principal stretches, with a quadratic volumetric energy.

Its derivatives by F are those of its spectral form, computed at points by NumPy: UFL has no eigenvalues. With F =
sum_a l_a n_a N_a^T, the stresses W_a = dW/dl_a and the components d_ab = n_a . dF N_b of a change dF,

    P = sum_a W_a n_a N_a^T,
    dP_aa = sum_b W_ab d_bb,
    dP_ab = (W_a - W_b)/(l_a - l_b) (d_ab + d_ba)/2 + (W_a + W_b)/(l_a + l_b) (d_ab - d_ba)/2,    a != b.

The first quotient is written with sinh(p d/2) / sinh(d/2), d = ln(l_a / l_b), which is exact however close l_a and l_b.
Source: Ogden, Proc. R. Soc. Lond. A 326 (1972) 565-584; Ogden, Non-linear Elastic Deformations (1984), section 6.1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
import ufl

from solvers.api import Array
from solvers.structure.materials.material import Tensor
from solvers.values import Value, combine, evaluate


class Spectral(NamedTuple):
    """Energy, stress and what the tangent needs of n deformation gradients."""

    energy: Array  #: of the distortion [J/m^3], shape (n,)
    stress: Array  #: P [Pa], shape (n, 3, 3)
    logarithms: Array  #: ln l_a, shape (n, 3)
    spatial: Array  #: n_a in columns, shape (n, 3, 3)
    material: Array  #: N_a in columns, shape (n, 3, 3)


@dataclass(frozen=True)
class Ogden:
    """W = sum_p mu_p/alpha_p (m_1^alpha_p + m_2^alpha_p + m_3^alpha_p - 3) + bulk/2 (J - 1)^2, m_a = J^(-1/3) l_a.

    The shear modulus at small strains is mu = 1/2 sum_p mu_p alpha_p.
    """

    terms: tuple[tuple[Value, float], ...]  #: mu_p [Pa] and alpha_p
    bulk: Value
    density: Value = 0.0
    mu: Value = field(init=False)
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    def __post_init__(self) -> None:
        exponents = [exponent for _, exponent in self.terms]

        def half_sum(*moduli):  # type: ignore[no-untyped-def]
            return sum(modulus * exponent for modulus, exponent in zip(moduli, exponents, strict=True)) / 2

        object.__setattr__(self, "mu", combine(half_sum, *(modulus for modulus, _ in self.terms)))

    def energy(self, F: Tensor, mu: Tensor, bulk: Tensor) -> Tensor:
        return self.distortional(F, mu, bulk) + self.volumetric(ufl.det(F), mu, bulk)

    def volume_ratio(self, F: Tensor) -> Tensor:
        return ufl.det(F)

    def volumetric(self, J: Tensor, mu: Tensor, bulk: Tensor) -> Tensor:
        return bulk / 2 * (J - 1) ** 2

    def distortional(self, F: Tensor, mu: Tensor, bulk: Tensor) -> Tensor:
        """To second order in the strain; `solvers/structure/principal.py` has that of any deformation."""
        e = ufl.sym(F) - ufl.Identity(F.ufl_shape[0])
        return mu * (ufl.inner(e, e) - ufl.tr(e) ** 2 / 3)

    def moduli(self, points: Array) -> list[tuple[Array, float]]:
        """(mu_p, alpha_p) of each term at points [m] of shape (3, n), mu_p of shape (n,)."""
        return [(evaluate(modulus, points, 0.0), exponent) for modulus, exponent in self.terms]


def at_gradients(F: Array, terms: list[tuple[Array, float]]) -> Spectral:
    """Energy and stress of the distortion for F of shape (n, 3, 3); not finite where det F <= 0."""
    possible = np.isfinite(F).all(axis=(1, 2))
    possible[possible] &= np.linalg.det(F[possible]) > 0.0
    safe = np.where(possible[:, None, None], F, np.eye(3))
    squares, N = np.linalg.eigh(safe.swapaxes(1, 2) @ safe)
    n = safe @ N / np.sqrt(squares)[:, None, :]
    logarithms = np.where(possible[:, None], np.log(squares) / 2, np.nan)
    stress, energy = np.zeros_like(logarithms), np.zeros(len(F))
    for modulus, exponent in terms:
        grown = np.expm1(exponent * _distortion(logarithms))
        energy += modulus / exponent * grown.sum(axis=1)
        stress += modulus[:, None] * (grown - grown.mean(axis=1, keepdims=True))
    stress *= np.exp(-logarithms)
    P = (n * stress[:, None, :]) @ N.swapaxes(1, 2)
    return Spectral(energy, P, logarithms, n, N)


def tangent(found: Spectral, terms: list[tuple[Array, float]], dim: int = 3) -> Array:
    """dP/dF [Pa] of the distortion, the first `dim` rows and columns of P and F by rows, shape (n, dim^2, dim^2)."""
    logarithms, stretches = found.logarithms, np.exp(found.logarithms)
    deviator = np.eye(3) - 1 / 3
    stress, slopes = np.zeros_like(stretches), np.zeros((len(stretches), 3, 3))  # by logarithms
    difference = np.zeros_like(slopes)  # (W_a - W_b)/(l_a - l_b)
    products = stretches[:, :, None] * stretches[:, None, :]
    apart = (logarithms[:, :, None] - logarithms[:, None, :]) / 2
    for modulus, exponent in terms:
        grown = np.expm1(exponent * _distortion(logarithms))
        mean, factor = grown.mean(axis=1), modulus[:, None, None]
        stress += modulus[:, None] * (grown - mean[:, None])
        slopes += factor * exponent * (deviator @ ((grown[:, :, None] + 1.0) * deviator))
        scale = np.exp(-exponent * logarithms.mean(axis=1))[:, None, None]
        powers = scale * products ** (exponent / 2 - 1) * _quotient(exponent - 1.0, apart)
        difference += factor * (powers + (1.0 + mean)[:, None, None] / products)
    W = stress / stretches
    local = np.zeros((len(stretches), 9, 9))
    diagonal = np.array([0, 4, 8])
    of_stretches = slopes / products
    of_stretches[:, range(3), range(3)] -= stress / stretches**2
    local[:, diagonal[:, None], diagonal] = of_stretches
    sums = (W[:, :, None] + W[:, None, :]) / (stretches[:, :, None] + stretches[:, None, :])
    for a in range(3):
        for b in range(3):
            if a != b:
                local[:, 3 * a + b, 3 * a + b] = (difference[:, a, b] + sums[:, a, b]) / 2
                local[:, 3 * a + b, 3 * b + a] = (difference[:, a, b] - sums[:, a, b]) / 2
    frames = np.einsum("nia,njb->nijab", found.spatial[:, :dim], found.material[:, :dim]).reshape(-1, dim**2, 9)
    return frames @ local @ frames.swapaxes(1, 2)


def _distortion(logarithms: Array) -> Array:
    return logarithms - logarithms.mean(axis=1, keepdims=True)


def _quotient(power: float, half: Array) -> Array:
    """sinh(power half) / sinh(half), and its limit where half = 0."""
    zero = half == 0.0
    safe = np.where(zero, 1.0, half)
    return np.where(zero, power, np.sinh(power * safe) / np.sinh(safe))
