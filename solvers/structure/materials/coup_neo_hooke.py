"""Compressible neo-Hooke law with a power of the volume ratio."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import ufl

from solvers.structure.materials.material import Tensor, cube_root, in_space
from solvers.structure.materials.neo_hooke import neo_hooke_distortion
from solvers.values import Value

#: Exponent below which `_inverse_power` is a series, whose relative error is below 1e-14 for J from 0.01 to 100.
_SMALL = 1e-3


def _inverse_power(J: Tensor, n: Tensor) -> Tensor:
    """(J^-n - 1)/n, for small n >= 0 by its series about the limit -ln J."""
    x = -n * ufl.ln(J)
    series = -ufl.ln(J) * (1 + x / 2 * (1 + x / 3 * (1 + x / 4 * (1 + x / 5))))
    return ufl.conditional(ufl.lt(n, _SMALL), series, (ufl.exp(x) - 1) / ufl.max_value(n, _SMALL))


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
        return mu * _inverse_power(J, lmbda / mu) + 3 * mu / 2 * (cube_root(J) ** 2 - 1)

    def distortional(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        return neo_hooke_distortion(F, mu)
