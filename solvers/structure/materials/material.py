"""The interface of material laws, and their parameters.

Energies are per reference volume [J/m^3], functions of the deformation gradient F. Values are numbers or functions of
the reference position; `energy` receives them as UFL coefficients by name. In 2D, F is 2x2: plane strain completes it
with F_33 = 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any, ClassVar, Protocol, TypeAlias

import ufl

from solvers.values import Value

Tensor: TypeAlias = Any  #: a UFL expression


class Material(Protocol):
    """A hyperelastic material law."""

    #: whether it is a law of plane stress, in 2D with S_33 = 0
    plane_stress: ClassVar[bool]
    #: whether it is a law of small displacements, a function of sym(F) - I, which is not objective
    linear: ClassVar[bool]

    @property
    def density(self) -> Value:
        """Reference density [kg/m^3]."""
        ...

    @property
    def energy(self) -> Callable[..., Tensor]:
        """Stored energy W(F, parameters by name)."""
        ...

    def volume_ratio(self, F: Tensor) -> Tensor:
        """J = det F, or 1 + the trace of the strain in laws of small strain."""
        ...

    @property
    def volumetric(self) -> Callable[..., Tensor]:
        """Energy of a pure change of volume: U(J, parameters by name) = W(s I), where s I has the volume ratio J."""
        ...

    @property
    def distortional(self) -> Callable[..., Tensor]:
        """W(F) - U(J), with parameters by name."""
        ...


def parameters(material: Material) -> dict[str, Value]:
    """The parameters of the energy in UFL by name."""
    others = ("density", "terms")
    return {f.name: getattr(material, f.name) for f in fields(material) if f.name not in others}  # type: ignore[arg-type]


def in_space(F: Tensor) -> Tensor:
    """F in 3D; in plane strain F_33 = 1."""
    if F.ufl_shape == (3, 3):
        return F
    return ufl.as_tensor([[F[0, 0], F[0, 1], 0], [F[1, 0], F[1, 1], 0], [0, 0, 1]])


def isochoric_trace(F: Tensor) -> Tensor:
    """J^(-2/3) I_1, the trace of C without its change of volume."""
    return ufl.exp(-2 / 3 * ufl.ln(ufl.det(F))) * ufl.tr(in_space(F).T * in_space(F))


def cube_root(J: Tensor) -> Tensor:
    """J^(1/3)."""
    return ufl.exp(ufl.ln(J) / 3)
