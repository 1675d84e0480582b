"""The compiled forms of the flow over cells: bulk, stabilisation, interface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import ufl

from solvers import fem
from solvers.fluid import forms, nitsche
from solvers.fluid.space import Unknowns
from solvers.fluid.weights import Weights


@dataclass(frozen=True)
class CellForms:
    """Residuals and tangents over uncut cells and, with bodies, cut ones and films."""

    residuals: tuple[fem.Integral, ...]
    tangents: tuple[fem.Integral, ...]

    def integrals(self) -> list[fem.Integral]:
        """What is to be compiled; forms of films are when there is one."""
        return [*self.residuals[:2], *self.tangents[:2]]


def cell_forms(unknowns: Unknowns, flow: forms.Coefficients, function: Any, weights: Weights | None) -> CellForms:
    """Forms at the function of velocity and pressure; weights: of the interface, if there is one."""
    domain, degree = unknowns.grid.domain, unknowns.degree
    test, trial = ufl.TestFunction(unknowns.space), ufl.TrialFunction(unknowns.space)
    (u, p), (v, q) = (unknowns.parts(f) for f in (function, test))
    everywhere = forms.bulk(flow, u, p, v, q) + forms.residual_based(flow, u, p, v, q)
    residuals = [everywhere * fem.measure(domain, "dx", 2 * degree + 1)]
    if weights is not None:
        dx_cut = fem.measure(domain, "dx", weights.degree)
        on_interface = nitsche.own(flow, weights, u, p, v, q)
        residuals.append(weights.fluid * everywhere * dx_cut + on_interface * dx_cut)
        residuals.append(weights.fluid * forms.film(flow, u, p, v, q) * dx_cut + on_interface * dx_cut)
    tangents = [ufl.derivative(form, function, trial) for form in residuals]
    return CellForms(
        tuple(fem.Integral(domain, form) for form in residuals),
        tuple(fem.Integral(domain, form) for form in tangents),
    )
