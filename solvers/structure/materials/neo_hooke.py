"""Compressible neo-Hooke law with the logarithm of the volume ratio."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import ufl

from solvers.structure.materials.material import Tensor, cube_root, in_space
from solvers.values import Value


def neo_hooke_distortion(F: Tensor, mu: Tensor) -> Tensor:
    """mu/2 (I_1 - 3 J^(2/3))."""
    return mu / 2 * (ufl.tr(in_space(F).T * in_space(F)) - 3 * cube_root(ufl.det(F)) ** 2)


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
        return 3 * mu / 2 * (cube_root(J) ** 2 - 1) - mu * ufl.ln(J) + lmbda / 2 * ufl.ln(J) ** 2

    def distortional(self, F: Tensor, mu: Tensor, lmbda: Tensor) -> Tensor:
        return neo_hooke_distortion(F, mu)
