"""Mooney-Rivlin law with a quadratic volumetric energy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import ufl

from solvers.structure.materials.material import Tensor, in_space
from solvers.values import Value


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
