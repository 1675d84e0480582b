"""Linear elasticity: Hooke's law with the linear strain, in 3D, plane strain and plane stress."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import ufl

from solvers.structure.materials.material import Tensor
from solvers.structure.materials.st_venant_kirchhoff import StVenantKirchhoff


@dataclass(frozen=True)
class LinearElastic(StVenantKirchhoff):
    """W = lambda/2 (tr e)^2 + mu e:e with the linear strain e = sym(grad u)."""

    linear: ClassVar[bool] = True

    def strain(self, F: Tensor) -> Tensor:
        return ufl.sym(F) - ufl.Identity(F.ufl_shape[0])


@dataclass(frozen=True)
class PlaneStressLinearElastic(LinearElastic):
    """The energy of `LinearElastic` in 2D with the lambda of `plane_stress_lambda`."""

    plane_stress: ClassVar[bool] = True
