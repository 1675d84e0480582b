"""A material law from a function W(F, parameters) of one's own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import make_dataclass
from typing import NamedTuple

import numpy as np
import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

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
    """The constants of an energy, by its derivatives.

    Raises what `energy` raises, and TypeError or ValueError if its value is no finite number.
    """
    named = {name: ufl.as_ufl(float(value)) for name, value in values.items()}
    F = ufl.variable(ufl.as_matrix(np.eye(3).tolist()))
    expression = ufl.as_ufl(energy(F, **named))
    if expression.ufl_shape:
        raise TypeError(f"has the shape {expression.ufl_shape}, not that of a number")
    stress = _numbers(ufl.diff(expression, F))
    tangent = _numbers(ufl.diff(ufl.diff(expression, F), F))
    if not (np.isfinite(stress).all() and np.isfinite(tangent).all()):
        raise ValueError("has no finite derivatives where F is the identity")
    shear = np.einsum("ijij->ij", tangent)[~np.eye(3, dtype=bool)]
    return SmallStrains(float(shear.mean()), float(np.einsum("iijj->ij", tangent).mean()), float(abs(stress).max()))


def _numbers(tensor: Tensor) -> Array:
    """The entries of a tensor without coefficients."""
    lowered = apply_derivatives(apply_algebra_lowering(tensor))
    found = np.empty(lowered.ufl_shape)
    for place in np.ndindex(*found.shape):
        found[place] = lowered[place](())
    return found
