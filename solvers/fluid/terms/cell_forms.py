"""The compiled forms of the flow over cells: bulk, stabilisation, interface, and the integrands of some at points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import ufl

from solvers import fem
from solvers.fluid.cut.weights import Weights
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.terms import forms, nitsche
from solvers.fluid.terms.shape_derivatives.surface_integrands import FilmIntegrands, MeanIntegrands
from solvers.fluid.terms.surface_terms import SurfaceOperators


@dataclass(frozen=True)
class CellForms:
    """Residuals and tangents over uncut cells and, with bodies, cut ones and films."""

    residuals: tuple[fem.Integral, ...]
    tangents: tuple[fem.Integral, ...]
    flow_in_gaps: fem.Pointwise | None = None  #: `forms.flow_in_gaps` in the middle of cells
    #: for the derivatives by the motion of surfaces, at the points of cut cells: integrands over the fluid by test
    #: function, for first degree what is added in gaps, and the terms of surfaces
    moving: tuple[fem.Pointwise, fem.Pointwise, MeanIntegrands] | None = None
    films: tuple[fem.Pointwise, FilmIntegrands] | None = None
    surfaces: SurfaceOperators | None = None  #: with bodies

    def integrals(self) -> list[fem.Integral]:
        """Forms to compile at the start; those of films are compiled when a film appears."""
        return [*self.residuals[:2], *self.tangents[:2]]


def coefficients(
    domain: fem.Domain, settings: FlowSettings, a: Any, history: Any, force: Any, *, alpha: tuple[Any, Any], newton: Any
) -> forms.Coefficients:
    """Coefficients of the terms of a flow: functions a [m/s], history [m/s^2] and force [N/m^3], and its constants.

    force: None: zero; alpha: of the time derivative and of the scales of the stabilisation [1/s].
    """
    return forms.Coefficients(
        rho=fem.constant(domain, settings.density),
        mu=fem.constant(domain, settings.viscosity),
        alpha=alpha[0],
        scale_alpha=alpha[1],
        a=a,
        newton=newton,
        history=history,
        force=forms.nothing(domain.dim) if force is None else force,
        convection=settings.convection,
        steady=settings.steady,
        degree=settings.degree,
        mesh=domain.mesh.ufl_domain(),
        shear=_shear(domain, settings),
    )


def _shear(domain: fem.Domain, settings: FlowSettings) -> tuple[Any, Any, Any] | None:
    """Constants of the law of shear, so that all flows share their compiled forms; None: there is none."""
    if (law := settings.shear) is None:
        return None
    return fem.constant(domain, law.infinite), fem.constant(domain, law.time), fem.constant(domain, law.exponent)


def cell_forms(
    unknowns: Unknowns,
    flow: forms.Coefficients,
    function: Any,
    weights: Weights | None,
    gaps: forms.GapScales | None = None,
    *,
    on_cut: forms.Coefficients | None = None,
) -> CellForms:
    """Forms at a function of velocity and pressure; weights: coefficients of cut cells, None without bodies.

    on_cut: coefficients of the terms in cut cells, None: `flow`; gaps: coefficients of gaps, for first degree.
    """
    domain = unknowns.grid.domain
    test, trial = ufl.TestFunction(unknowns.space), ufl.TrialFunction(unknowns.space)
    both = flow, on_cut or flow
    residuals = _residuals(unknowns, both, function, test, weights, gaps)
    # the body force has no derivative: without it, all flows share their compiled tangents
    without, cut_without = (replace(terms, force=forms.nothing(unknowns.grid.dim)) for terms in both)
    same_slope = _residuals(unknowns, (without, cut_without), function, test, weights, gaps)
    tangents = [ufl.derivative(form, function, trial) for form in same_slope]
    found = CellForms(
        tuple(fem.Integral(domain, form) for form in residuals),
        tuple(fem.Integral(domain, form) for form in tangents),
    )
    if weights is None:
        return found
    parts, what = (*unknowns.parts(function), *unknowns.parts(test)), "the flow's derivative by the motion of surfaces"
    points, middle = weights.reference, np.full((1, domain.dim), 0.5)
    in_cut, special = (fem.Pointwise(domain, some, points, what) for some in _on_cut(*both, parts, gaps))
    moving = in_cut, special, MeanIntegrands(domain, both[1])
    found = replace(found, surfaces=SurfaceOperators(domain, both[1]))
    if gaps is None:
        return replace(found, moving=moving, films=(special, FilmIntegrands(domain, both[1], parts, points)))
    in_gaps = fem.Pointwise(domain, forms.flow_in_gaps(flow, gaps, *parts[:2]), middle, "the flow in gaps")
    return replace(found, flow_in_gaps=in_gaps, moving=moving)


def _residuals(
    unknowns: Unknowns,
    of: tuple[forms.Coefficients, forms.Coefficients],
    function: Any,
    test: Any,
    weights: Weights | None,
    gaps: forms.GapScales | None,
) -> list[Any]:
    """Forms over uncut cells and, with weights, over cut ones and films; in gaps: what is added in cut, uncut cells."""
    domain, degree, (flow, cut) = unknowns.grid.domain, unknowns.degree, of
    parts = *unknowns.parts(function), *unknowns.parts(test)
    dx = fem.measure(domain, "dx", 2 * degree + 1)
    uncut = _everywhere(flow, *parts) * dx
    if weights is None:
        return [uncut]
    dx_cut = fem.measure(domain, "dx", weights.degree)
    on_interface = nitsche.own(cut, weights, *parts)
    in_cut, special = (weights.fluid * integrand for integrand in _on_cut(flow, cut, parts, gaps))
    whole = in_cut * dx_cut + on_interface * dx_cut
    if gaps is not None:
        return [uncut, whole, special * dx_cut, forms.in_gaps(flow, gaps, *parts) * dx]
    return [uncut, whole, special * dx_cut + on_interface * dx_cut]


def _on_cut(
    flow: forms.Coefficients, cut: forms.Coefficients, parts: tuple[Any, ...], gaps: forms.GapScales | None
) -> list[Any]:
    """Integrands over the fluid in cut cells, and in films; in gaps: what is added there. parts: u, p, v, q."""
    return [_everywhere(cut, *parts), forms.film(cut, *parts) if gaps is None else forms.in_gaps(flow, gaps, *parts)]


def _everywhere(flow: forms.Coefficients, u: Any, p: Any, v: Any, q: Any) -> Any:
    return forms.bulk(flow, u, p, v, q) + forms.residual_based(flow, u, p, v, q)
