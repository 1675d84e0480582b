"""A material law from a function W(F, parameters) of one's own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import make_dataclass
from typing import NamedTuple

import numpy as np
import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.algorithms.expand_indices import expand_indices

from solvers.api import Array
from solvers.structure.materials.material import Material, Tensor, cube_root, in_space
from solvers.values import Value


def law_of_energy(energy: Callable[..., Tensor], values: Mapping[str, Value], density: Value = 0.0) -> Material:
    """The law with the stored energy `energy(F, **values)` [J/m^3]; F is 3x3 in plane strain, too.

    The parts of the mixed element follow from it: U(J) = W(J^(1/3) I) and D(F) = W(F) - U(J).
    """

    def whole(self: Material, F: Tensor, **named: Tensor) -> Tensor:
        return energy(in_space(F), **named)

    def volumetric(self: Material, J: Tensor, **named: Tensor) -> Tensor:
        return energy(cube_root(J) * ufl.Identity(3), **named)

    def distortional(self: Material, F: Tensor, **named: Tensor) -> Tensor:
        return energy(in_space(F), **named) - volumetric(self, ufl.det(F), **named)

    def volume_ratio(self: Material, F: Tensor) -> Tensor:
        return ufl.det(F)

    methods = {method.__name__: method for method in (volumetric, distortional, volume_ratio)}
    constants = {"plane_stress": False, "linear": False}
    namespace = {**methods, "energy": whole, **constants}
    made = make_dataclass("OwnEnergy", [*values, "density"], frozen=True, namespace=namespace)
    return made(**values, density=density)  # type: ignore[no-any-return]


class SmallStrains(NamedTuple):
    """A law close to F = I [Pa]. Isotropic laws without stress at F = I have these constants."""

    mu: float  #: mean of d2W/dF_ij dF_ij over i != j
    bulk: float  #: mean of d2W/dF_ii dF_jj over all i and j
    stress: float  #: largest entry of dW/dF at F = I


def at_small_strains(energy: Callable[..., Tensor], values: Mapping[str, float]) -> SmallStrains:
    """The constants of an energy, by its derivatives along directions of F: sums of entries are one of them.

    Raises what `energy` raises, and TypeError or ValueError if its value is no finite number.
    """
    entries = [_derivatives(energy, values, direction) for direction in np.eye(9).reshape(9, 3, 3)]
    stress, second = np.array(entries).T.reshape(2, 3, 3)
    _, volumetric = _derivatives(energy, values, np.eye(3))
    if not np.isfinite([*stress.ravel(), *second.ravel(), volumetric]).all():
        raise ValueError("has no finite derivatives where F is the identity")
    shear = second[~np.eye(3, dtype=bool)]
    return SmallStrains(float(shear.mean()), volumetric / 9, float(abs(stress).max()))


def _derivatives(energy: Callable[..., Tensor], values: Mapping[str, float], direction: Array) -> tuple[float, float]:
    """First and second derivative of W(I + s D) by s at s = 0; of all entries of F at once they would take minutes."""
    s = ufl.variable(ufl.as_ufl(0.0))
    F = ufl.as_matrix([[float(i == j) + float(direction[i, j]) * s for j in range(3)] for i in range(3)])
    expression = ufl.as_ufl(energy(F, **{name: ufl.as_ufl(float(value)) for name, value in values.items()}))
    if expression.ufl_shape:
        raise TypeError(f"has the shape {expression.ufl_shape}, not that of a number")
    first = apply_derivatives(ufl.diff(expand_indices(apply_algebra_lowering(expression)), s))
    return float(first(())), float(apply_derivatives(ufl.diff(first, s))(()))
