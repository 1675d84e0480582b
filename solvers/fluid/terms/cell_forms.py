"""The compiled forms of the flow over cells: bulk, stabilisation, interface."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import ufl

from solvers import fem
from solvers.fluid.cut.weights import Weights
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.terms import forms, nitsche


@dataclass(frozen=True)
class CellForms:
    """Residuals and tangents over uncut cells and, with bodies, cut ones and films."""

    residuals: tuple[fem.Integral, ...]
    tangents: tuple[fem.Integral, ...]

    def integrals(self) -> list[fem.Integral]:
        """Forms to compile at the start; those of films are compiled when a film appears."""
        return [*self.residuals[:2], *self.tangents[:2]]


def coefficients(
    domain: fem.Domain, settings: FlowSettings, a: Any, history: Any, force: Any, *, alpha: tuple[Any, Any], newton: Any
) -> forms.Coefficients:
    """Coefficients of the terms of a flow: functions a [m/s], history [m/s^2] and force [N/m^3], and its constants.

    alpha: of the time derivative and of the scales of the stabilisation [1/s].
    """
    return forms.Coefficients(
        rho=fem.constant(domain, settings.density),
        mu=fem.constant(domain, settings.viscosity),
        alpha=alpha[0],
        scale_alpha=alpha[1],
        a=a,
        newton=newton,
        history=history,
        force=forms.nothing(domain.dim) if settings.body_force is None else force,
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
    return CellForms(
        tuple(fem.Integral(domain, form) for form in residuals),
        tuple(fem.Integral(domain, form) for form in tangents),
    )


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
    (u, p), (v, q) = (unknowns.parts(f) for f in (function, test))
    everywhere, in_cut = (forms.bulk(f, u, p, v, q) + forms.residual_based(f, u, p, v, q) for f in of)
    uncut = everywhere * fem.measure(domain, "dx", 2 * degree + 1)
    if weights is None:
        return [uncut]
    dx_cut = fem.measure(domain, "dx", weights.degree)
    on_interface = nitsche.own(cut, weights, u, p, v, q)
    if gaps is not None:
        added = forms.in_gaps(flow, gaps, u, p, q)
        whole = weights.fluid * in_cut * dx_cut + on_interface * dx_cut
        return [uncut, whole, weights.fluid * added * dx_cut, added * fem.measure(domain, "dx", 2 * degree + 1)]
    film = forms.film(cut, u, p, v, q)
    return [uncut, *(weights.fluid * bulk * dx_cut + on_interface * dx_cut for bulk in (in_cut, film))]
