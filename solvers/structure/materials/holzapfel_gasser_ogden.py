"""Holzapfel-Gasser-Ogden law: a soft matrix with two families of fibres that carry tension only, as in arteries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import ufl

from solvers.structure.materials.material import Tensor, in_space, isochoric_trace
from solvers.values import Value


@dataclass(frozen=True)
class HolzapfelGasserOgden:
    """W = mu/2 (I - 3) + sum over families k1/(2 k2) (exp(k2 E^2) - 1) + bulk/2 (J - 1)^2, where E > 0.

    E = kappa (I - 3) + (1 - 3 kappa) (J^(-2/3) a.C a - 1) with I = J^(-2/3) I_1, unit directions a and b of the
    families in the undeformed body, and their dispersion kappa, 0 (all alike) to 1/3 (none preferred). Directions may
    have any length. One family is two alike with half of k1.
    Source: Gasser, Ogden & Holzapfel, J. R. Soc. Interface 3 (2006), equations 4.2 and 4.3.
    """

    mu: Value
    k1: Value
    k2: Value
    dispersion: Value
    bulk: Value
    a_x: Value
    a_y: Value
    a_z: Value
    b_x: Value
    b_y: Value
    b_z: Value
    density: Value = 0.0
    plane_stress: ClassVar[bool] = False
    linear: ClassVar[bool] = False

    def energy(self, F: Tensor, **constants: Tensor) -> Tensor:
        return self.distortional(F, **constants) + self.volumetric(ufl.det(F), **constants)

    def volume_ratio(self, F: Tensor) -> Tensor:
        return ufl.det(F)

    def volumetric(self, J: Tensor, *, bulk: Tensor, **constants: Tensor) -> Tensor:
        return bulk / 2 * (J - 1) ** 2

    def distortional(
        self, F: Tensor, *, mu: Tensor, k1: Tensor, k2: Tensor, dispersion: Tensor, **more: Tensor
    ) -> Tensor:
        matrix = isochoric_trace(F) - 3
        scale = ufl.exp(-2 / 3 * ufl.ln(ufl.det(F)))
        found = mu / 2 * matrix
        for family in "ab":
            direction = ufl.as_vector([more[f"{family}_{axis}"] for axis in "xyz"])
            stretched = in_space(F) * direction
            square = scale * ufl.inner(stretched, stretched) / ufl.inner(direction, direction)
            strain = dispersion * matrix + (1 - 3 * dispersion) * (square - 1)
            stored = k1 / (2 * k2) * (ufl.exp(k2 * strain**2) - 1)
            found += ufl.conditional(ufl.gt(strain, 0), stored, 0)
        return found
