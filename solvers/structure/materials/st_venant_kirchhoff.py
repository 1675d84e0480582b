"""St. Venant-Kirchhoff: Hooke's law with the Green-Lagrange strain, in 3D, plane strain and plane stress."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import ufl

from solvers.structure.materials.material import Tensor
from solvers.values import Value


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
    """The energy of `StVenantKirchhoff` in 2D with the lambda of `plane_stress_lambda`."""

    plane_stress: ClassVar[bool] = True
