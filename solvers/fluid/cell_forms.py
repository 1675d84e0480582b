"""The compiled forms of the flow over cells: bulk, stabilisation, interface."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import ufl

from solvers import fem
from solvers.fluid import forms, nitsche
from solvers.fluid.background.space import Unknowns
from solvers.fluid.cutting.weights import Weights


@dataclass(frozen=True)
class CellForms:
    """Residuals and tangents over uncut cells and, with bodies, cut ones and films."""

    residuals: tuple[fem.Integral, ...]
    tangents: tuple[fem.Integral, ...]

    def integrals(self) -> list[fem.Integral]:
        """Forms to compile at the start; those of films are compiled when a film appears."""
        return [*self.residuals[:2], *self.tangents[:2]]


def cell_forms(unknowns: Unknowns, flow: forms.Coefficients, function: Any, weights: Weights | None) -> CellForms:
    """Forms at a function of velocity and pressure; weights: coefficients of cut cells, None without bodies."""
    domain = unknowns.grid.domain
    test, trial = ufl.TestFunction(unknowns.space), ufl.TrialFunction(unknowns.space)
    residuals = _residuals(unknowns, flow, function, test, weights)
    # the body force has no derivative: without it, all flows share their compiled tangents
    same_slope = _residuals(unknowns, replace(flow, force=forms.nothing(unknowns.grid.dim)), function, test, weights)
    tangents = [ufl.derivative(form, function, trial) for form in same_slope]
    return CellForms(
        tuple(fem.Integral(domain, form) for form in residuals),
        tuple(fem.Integral(domain, form) for form in tangents),
    )


def _residuals(
    unknowns: Unknowns, flow: forms.Coefficients, function: Any, test: Any, weights: Weights | None
) -> list[Any]:
    """Forms over uncut cells and, with weights, over cut ones and films."""
    domain, degree = unknowns.grid.domain, unknowns.degree
    (u, p), (v, q) = (unknowns.parts(f) for f in (function, test))
    everywhere = forms.bulk(flow, u, p, v, q) + forms.residual_based(flow, u, p, v, q)
    uncut = everywhere * fem.measure(domain, "dx", 2 * degree + 1)
    if weights is None:
        return [uncut]
    dx_cut = fem.measure(domain, "dx", weights.degree)
    on_interface = nitsche.own(flow, weights, u, p, v, q)
    film = forms.film(flow, u, p, v, q)
    return [uncut, *(weights.fluid * bulk * dx_cut + on_interface * dx_cut for bulk in (everywhere, film))]
