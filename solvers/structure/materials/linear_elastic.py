"""Linear elasticity: Hooke's law of the strain of small displacements, in space and in plane stress."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import ufl

from solvers.structure.materials.material import Tensor
from solvers.structure.materials.st_venant_kirchhoff import StVenantKirchhoff


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
