"""Kinds of conditions on the faces of the box. A record `PatchKind` defines each, and users may add their own.

A kind prescribes components of the velocity, or the stress t = sigma n [Pa] that acts on the fluid from outside. The
equations then have -<t, v> with the test functions v of the velocity.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol

from solvers.api import Array

if TYPE_CHECKING:
    from solvers.fluid.terms.forms import Coefficients

Expr = Any


class PartlyCoveredFaces(Protocol):
    """Faces of cells on one face of the box that bodies cover in part, with points on their wet part."""

    def along_normal(self, values: Array) -> Array:
        """Vectors of given lengths along the outward normal."""
        ...

    def outflow(self, mu: float | Array, mass_flux: Array) -> Array:
        """d/du of the form of an outflow."""
        ...

    def friction(self, factor: Array) -> Array:
        """d/du of <factor u, v>, with factors [Pa s/m] at the points."""
        ...


@dataclass(frozen=True)
class PatchKind:
    """One kind of condition. n: outward normal."""

    prescribed: Literal["all", "normal", "tangential", "none"] = "none"  #: components of the velocity
    value: Literal["velocity", "vector", "number"] | None = None  #: what a patch of this kind is given
    open: bool = False  #: the normal velocity is free: the condition determines the level of the pressure
    periodic: bool = False
    #: (flow, u, value, n, v) -> integrand of -<t, v>; a number comes as such
    form: Callable[[Coefficients, Expr, Expr, Expr, Expr], Expr] | None = None
    depends_on_flow: bool = False  #: the form has u; where bodies cover a face, linearly
    #: The same for faces that bodies cover in part, at points of the wet part:
    #: (faces, values at the points) -> t [Pa], shape (cells, points, dim); not for forms with u
    stress: Callable[[PartlyCoveredFaces, Array], Array] | None = None
    #: (faces, mu, or (cells, 1) of it, rho a, values at the points) -> d<-t, v>/du; a: velocity of the step before;
    #: for forms with u
    slope: Callable[[PartlyCoveredFaces, float | Array, Array, Array | None], Array] | None = None

    @property
    def normal_given(self) -> bool:
        """It prescribes the normal velocity."""
        return self.prescribed in ("all", "normal")


def _traction(flow: Coefficients, u: Expr, t: Expr, n: Expr, v: Expr) -> Expr:
    """-<t, v> with the given traction [Pa]."""
    return -_dot(t, v)


def _pressure(flow: Coefficients, u: Expr, p: Expr, n: Expr, v: Expr) -> Expr:
    """<p, n . v> with the given pressure [Pa]: n . sigma n = -p."""
    return p * _dot(n, v)


def _slip_length(flow: Coefficients, u: Expr, b: Expr, n: Expr, v: Expr) -> Expr:
    """<mu/b u, v>: the shear stress is -mu/b times the tangential velocity; the normal one is prescribed as zero."""
    return flow.viscosity(u) / b * _dot(u, v)


def _slip_slope(faces: PartlyCoveredFaces, mu: float | Array, mass_flux: Array, b: Array | None) -> Array:
    assert b is not None
    return faces.friction(mu / b[:, :, 0])


def _outflow(flow: Coefficients, u: Expr, value: Expr, n: Expr, v: Expr) -> Expr:
    """Directional do-nothing condition: mu d_n u - p n = rho/2 min(0, u . n) u, so that no energy enters.

    -<mu (grad u)^T n, v> - rho/2 <min(0, u . n) u, v>. A parallel flow fulfils it.
    Source: Braack, Mucha, J. Comput. Math. 32 (2014) 507-521.
    """
    import ufl

    terms = -flow.viscosity(u) * _dot(_dot(n, ufl.grad(u)), v)
    if flow.convection:
        back = 0.5 * (_dot(flow.a, n) - abs(_dot(flow.a, n)))
        terms -= 0.5 * flow.rho * back * _dot(u, v)
    return terms


def _dot(a: Expr, b: Expr) -> Expr:
    import ufl  # here: case files need the names of the kinds only, and the import takes long

    return ufl.dot(a, b)


_OUTFLOW = PatchKind(
    open=True, form=_outflow, depends_on_flow=True,
    slope=lambda faces, mu, mass_flux, values: faces.outflow(mu, mass_flux),
)  # fmt: skip
#: By their names in `Patch` and in the case file. The pressure of resistance and windkessel is in `outlet_terms`.
PATCH_KINDS: Mapping[str, PatchKind] = {
    "velocity": PatchKind("all", value="velocity"),
    "no_slip": PatchKind("all"),
    "slip": PatchKind("normal"),
    "symmetry": PatchKind("normal"),
    "slip_length": PatchKind("normal", value="number", form=_slip_length, depends_on_flow=True, slope=_slip_slope),
    "traction": PatchKind(value="vector", open=True, form=_traction, stress=lambda faces, t: t),
    "pressure": PatchKind(
        "tangential", value="number", open=True, form=_pressure,
        stress=lambda faces, p: -faces.along_normal(p[:, :, 0]),
    ),
    "outflow": _OUTFLOW,
    "resistance": _OUTFLOW,
    "windkessel": _OUTFLOW,
    "periodic": PatchKind(periodic=True),
}  # fmt: skip
