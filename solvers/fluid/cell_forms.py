"""The compiled forms of the flow over cells and inner faces: bulk, stabilisation, interface, ghost penalty."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import ufl

from solvers import fem
from solvers.fluid import forms
from solvers.fluid.space import Unknowns
from solvers.fluid.weights import Weights


@dataclass(frozen=True)
class CellForms:
    """Residuals and tangents over uncut cells and, with bodies, cut ones and films; the ghost penalty with bodies."""

    residuals: tuple[fem.Integral, ...]
    tangents: tuple[fem.Integral, ...]
    ghost_penalty: fem.Integral | None
    ghost_history: fem.Integral | None  #: the share of the history in the ghost penalty, if any

    def integrals(self) -> list[fem.Integral]:
        """What is to be compiled; forms of films are when there is one."""
        ghost = [form for form in (self.ghost_penalty, self.ghost_history) if form is not None]
        return [*self.residuals[:2], *self.tangents[:2], *ghost]


def cell_forms(
    unknowns: Unknowns,
    flow: forms.Coefficients,
    function: Any,
    penalties: forms.Penalties,
    *,
    on_cut: tuple[Weights, forms.GhostScales] | None,
) -> CellForms:
    """Forms at the function of velocity and pressure; on_cut: what bodies need."""
    domain, degree = unknowns.grid.domain, unknowns.degree
    test, trial = ufl.TestFunction(unknowns.space), ufl.TrialFunction(unknowns.space)
    (u, p), (v, q), (du, dp) = (unknowns.parts(f) for f in (function, test, trial))
    everywhere = forms.bulk(flow, u, p, v, q) + forms.residual_based(flow, u, p, v, q)
    residuals, ghost_penalty, ghost_history = [everywhere * fem.measure(domain, "dx", 2 * degree + 1)], None, None
    if on_cut is not None:
        weights, scales = on_cut
        dx_cut, dS = fem.measure(domain, "dx", weights.degree), fem.measure(domain, "dS", 2 * degree)
        on_interface = forms.interface(flow, weights, u, p, v, q)
        residuals.append(weights.fluid * everywhere * dx_cut + on_interface * dx_cut)
        residuals.append(weights.fluid * forms.film(flow, u, p, v, q) * dx_cut + on_interface * dx_cut)
        ghost = forms.ghost_penalty(flow, penalties, scales, du, dp, v, q) * dS
        ghost_penalty, history = fem.Integral(domain, ufl.lhs(ghost)), ufl.rhs(ghost)
        ghost_history = None if history.empty() else fem.Integral(domain, history)
    tangents = [ufl.derivative(form, function, trial) for form in residuals]
    return CellForms(
        tuple(fem.Integral(domain, form) for form in residuals),
        tuple(fem.Integral(domain, form) for form in tangents),
        ghost_penalty,
        ghost_history,
    )
