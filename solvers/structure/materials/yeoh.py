"""Yeoh law for rubber, with a quadratic volumetric energy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import ufl

from solvers.structure.materials.material import Tensor, isochoric_trace
from solvers.values import Value


@dataclass(frozen=True)
class Yeoh:
    """W = c10 (I - 3) + c20 (I - 3)^2 + c30 (I - 3)^3 + bulk/2 (J - 1)^2 with I = J^(-2/3) I_1.

    Source: Yeoh, Rubber Chem. Technol. 66 (1993); shear modulus 2 c10.
    """

    c10: Value
    c20: Value
    c30: Value
    bulk: Value
    density: Value = 0.0
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    def energy(self, F: Tensor, c10: Tensor, c20: Tensor, c30: Tensor, bulk: Tensor) -> Tensor:
        return self.distortional(F, c10, c20, c30, bulk) + self.volumetric(ufl.det(F), c10, c20, c30, bulk)

    def volume_ratio(self, F: Tensor) -> Tensor:
        return ufl.det(F)

    def volumetric(self, J: Tensor, c10: Tensor, c20: Tensor, c30: Tensor, bulk: Tensor) -> Tensor:
        return bulk / 2 * (J - 1) ** 2

    def distortional(self, F: Tensor, c10: Tensor, c20: Tensor, c30: Tensor, bulk: Tensor) -> Tensor:
        x = isochoric_trace(F) - 3
        return c10 * x + c20 * x**2 + c30 * x**3
