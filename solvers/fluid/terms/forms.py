"""Weak forms of the flow on a cut grid: bulk, stabilisation, ghost penalty. The terms at surfaces are in `nitsche`.

h is an edge length of the cell. The time derivative is
alpha u - history, with alpha = 0 in steady flow. `a` is the velocity that scales the stabilisation: that of an earlier
step or iterate.
Sources: Massing, Schott, Wall, Comput. Methods Appl. Mech. Engrg. 328 (2018) 262-300; Schott, Wall, ibid. 276 (2014)
233-265; Burman, Fernandez, ibid. 279 (2014) 497-514; Tezduyar, Osawa, ibid. 190 (2000) 411-430 (tau).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import ufl
from ufl import avg, div, dot, grad, inner, sqrt, sym

from solvers.fluid.settings.penalties import Penalties

Expr = Any


@dataclass(frozen=True)
class Coefficients:
    """Coefficients that all terms share, and flags of the terms that a case leaves out."""

    rho: Expr  #: density [kg/m^3]
    mu: Expr  #: viscosity [Pa s], that at rest with a law of shear
    alpha: Expr  #: d(u_t)/du [1/s]
    scale_alpha: Expr  #: alpha for the scales of the stabilisation, of a step whose length changes slowly [1/s]
    a: Expr  #: velocity [m/s] for the scales of the stabilisation
    newton: Expr  #: 1, or 0 to linearise u . grad u about u = a without its second term (Picard)
    history: Expr  #: u_t = alpha u - history [m/s^2]
    force: Expr  #: body force [N/m^3]
    convection: bool  #: False: Stokes
    steady: bool
    degree: int  #: of the velocity
    mesh: Any
    shear: tuple[Expr, Expr, Expr] | None = None  #: mu_inf [Pa s], time [s] and exponent of `ShearLaw`

    def viscosity(self, u: Expr) -> Expr:
        """mu [Pa s] where the velocity is u."""
        if self.shear is None:
            return self.mu
        infinite, time, exponent = self.shear
        square = 2.0 * time**2 * inner(eps(u), eps(u))
        return infinite + (self.mu - infinite) * (1.0 + square) ** (0.5 * (exponent - 1.0))

    @property
    def sizes(self) -> list[Expr]:
        """Edge lengths [m] of an axis-aligned cell."""
        jacobian = ufl.Jacobian(self.mesh)
        return [jacobian[i, i] for i in range(ufl.Jacobian(self.mesh).ufl_shape[0])]


@dataclass(frozen=True)
class GapScales:
    """What the terms of gaps need in each cell, `gaps.NarrowGaps`."""

    share: Expr  #: of the PSPG term along the walls
    friction: Expr  #: 1 / tau where inertia along the gap does not matter [Pa s/m^2]
    past: Expr  #: momentum per volume and time of the flow in the gap at the start of the step [N/m^3]
    tangents: Expr  #: projector along the walls
    pressure: Expr  #: factor of the ghost penalty of the pressure
    kink: Expr  #: factor of that of the velocity, less 1, times the squares of the components of the normal


@dataclass(frozen=True)
class GhostScales:
    """Scales of the ghost penalty in each cell.

    phi_b = (|a| h)^2 / phi is small where viscosity or the term of the time step dominates phi. With phi instead, the
    term would be an artificial viscosity along bodies that grows as steps get smaller.
    """

    phi: Expr  #: nu + |a| h + alpha_s h^2 [m^2/s]
    convective: Expr  #: phi_b [m^2/s]
    has_history: Expr  #: 1 in cells whose nodes all have a velocity from the last step, else 0


def nothing(dim: int) -> Expr:
    """A zero vector field. Terms with it vanish before a form is compiled."""
    return ufl.as_vector([0.0] * dim)


def eps(u: Expr) -> Expr:
    return sym(grad(u))


def viscous_stress(flow: Coefficients, u: Expr) -> Expr:
    """2 mu eps(u)."""
    return 2.0 * flow.viscosity(u) * eps(u)


def inertia(flow: Coefficients, u: Expr) -> Expr:
    """rho (u_t + u . grad u) - f."""
    terms = -flow.force
    if not flow.steady:
        terms += flow.rho * (flow.alpha * u - flow.history)
    if flow.convection:
        terms += flow.rho * dot(grad(u), flow.newton * u + (1.0 - flow.newton) * flow.a)
    return terms


def bulk(flow: Coefficients, u: Expr, p: Expr, v: Expr, q: Expr) -> Expr:
    """Integrand of rho (u_t + u . grad u, v) + (2 mu eps(u), eps(v)) - (p, div v) + (q, div u) - (f, v)."""
    return dot(inertia(flow, u), v) + inner(viscous_stress(flow, u), eps(v)) - p * div(v) + q * div(u)


def residual_based(flow: Coefficients, u: Expr, p: Expr, v: Expr, q: Expr) -> Expr:
    """Integrand of the SUPG, PSPG and grad-div terms, (rho a . grad v + grad q, T R) + (tau_C div u, div v).

    tau_M = (4 rho^2 alpha_s^2 + rho^2 a . G a + 36 mu^2 G : G)^(-1/2), 144 for second degree,
    tau_C = (rho^2 a . G a + 36 mu^2 G : G)^(1/2) / tr G, G = diag(4 / h_i^2), T = tau_M I for second degree. For first
    degree T = diag(tau_i), with dim G_ii^2 in the place of G : G. For second degree the shortest edge bounds tau,
    because R has a viscous part: mu lap u, that of a field without divergence. alpha_s follows the step slowly, and
    tau_C has none of it (docs/theory_fluid.md, Weak form).
    Source of tau by direction: Blasco, Comput. Methods Appl. Mech. Engrg. 197 (2008) 3712-3723.
    """
    test = grad(q)
    if flow.convection:
        test += flow.rho * dot(grad(v), flow.a)
    metric, _, viscous = _rates(flow)
    grad_div = sqrt(_convective(flow) + viscous * sum(g**2 for g in metric)) / sum(metric) * div(u) * div(v)
    return _tested(flow, u, p, test) + grad_div


def in_gaps(flow: Coefficients, gaps: GapScales, u: Expr, p: Expr, v: Expr, q: Expr) -> Expr:
    """Integrand of -(B + T R, grad q) along the walls of a gap, with B of `flow_in_gaps` and T of `residual_based`."""
    metric, common, viscous = _rates(flow)
    strong, test = dot(gaps.tangents, inertia(flow, u) + grad(p)), dot(gaps.tangents, grad(q))
    taus = [1.0 / sqrt(common + viscous * len(metric) * g**2) for g in metric]
    B = flow_in_gaps(flow, gaps, u, p)
    return -gaps.share * sum(test[i] * (B[i] + elsewhere * strong[i]) for i, elsewhere in enumerate(taus))


def flow_in_gaps(flow: Coefficients, gaps: GapScales, u: Expr, p: Expr) -> Expr:
    """B = -tau (R - past) along the walls of a gap [m/s], tau = (rho^2 a . G a + friction^2)^(-1/2)."""
    tau = 1.0 / sqrt(gaps.friction**2 + _convective(flow))
    return -tau * dot(gaps.tangents, inertia(flow, u) + grad(p) - gaps.past)


def film(flow: Coefficients, u: Expr, p: Expr, v: Expr, q: Expr) -> Expr:
    """Integrand in cut cells with a film, where viscosity dominates: `bulk` of a flow without convection.

    A second-order velocity is a parabola across the film. Its continuation to the rest of the cell is (h / g)^2 times
    as large. The quadrature of cut cells is exact for products of two such velocities, in 3D not for the products of
    three in the convective term.
    """
    return bulk(creeping(flow), u, p, v, q)


def creeping(flow: Coefficients) -> Coefficients:
    """Coefficients of the same flow without convection."""
    return replace(flow, convection=False)


def _tested(flow: Coefficients, u: Expr, p: Expr, test: Expr) -> Expr:
    """test . T R with the residual R of the momentum equation."""
    metric, common, viscous = _rates(flow)
    square = sum(g**2 for g in metric)
    directions = [len(metric) * g**2 for g in metric] if flow.degree == 1 else [square] * len(metric)
    strong = inertia(flow, u) + grad(p)
    if flow.degree > 1:
        strong -= flow.viscosity(u) * div(grad(u))
        if flow.shear is not None:
            strong -= 2.0 * dot(eps(u), grad(flow.viscosity(u)))
    return sum(test[i] * strong[i] / sqrt(common + viscous * g) for i, g in enumerate(directions))


def _rates(flow: Coefficients) -> tuple[list[Expr], Expr, Expr]:
    """Diagonal of G [1/m^2], 4 rho^2 alpha_s^2 + rho^2 a . G a, and the factor of G : G in tau_M^-2."""
    common = _convective(flow)
    if not flow.steady:
        common += 4.0 * flow.rho**2 * flow.scale_alpha**2
    return _metric(flow), common, (36.0 if flow.degree == 1 else 144.0) * flow.viscosity(flow.a) ** 2


def _metric(flow: Coefficients) -> list[Expr]:
    """Diagonal of G [1/m^2]."""
    return [4.0 / h**2 for h in flow.sizes]


def _convective(flow: Coefficients) -> Expr:
    """rho^2 a . G a, zero without convection."""
    if not flow.convection:
        return 0.0
    return flow.rho**2 * sum(g * flow.a[i] ** 2 for i, g in enumerate(_metric(flow)))


def ghost_penalty(
    flow: Coefficients, factors: Penalties, scales: GhostScales, u: Expr, p: Expr, v: Expr, q: Expr
) -> Expr:
    """Integrand over faces, for first degree, of gamma_p h^3 / (rho phi) [d_n p] [d_n q] and

    h ((gamma_v mu + gamma_b rho phi_b) [d_n u] + gamma_t rho h^2 [d_n (u_t + gamma_f alpha_s u)]) [d_n v],

    u_t = alpha u - history, in cells without history alpha u (docs/theory_fluid.md, Ghost penalty).
    Source of mass matrices with it: Sticko, Kreiss, J. Sci. Comput. 80 (2019), doi:10.1007/s10915-019-01004-2.
    """
    n, h = _across_faces(flow)
    factor, mass = factors.ghost_viscous * flow.mu, 0.0
    if not flow.steady:
        mass = factors.ghost_mass * flow.rho * h**2
    if flow.convection:
        factor += factors.ghost_convection * flow.rho * avg(scales.convective)
    has_history = scales.has_history("+") * scales.has_history("-")

    fading = factors.ghost_fading * flow.scale_alpha
    change = (flow.alpha + fading) * _jump(u, n) - has_history * _jump(flow.history, n)
    of_pressure = factors.ghost_pressure * h**3 / (flow.rho * avg(scales.phi)) * _jump(p, n) * _jump(q, n)
    return of_pressure + h * dot(factor * _jump(u, n) + mass * change, _jump(v, n))


def ghost_penalty_in_gaps(
    flow: Coefficients, factors: Penalties, scales: GhostScales, gaps: GapScales, u: Expr, p: Expr, v: Expr, q: Expr
) -> Expr:
    """Integrand over faces of what `ghost_penalty` is more, or less, in gaps."""
    n, h = _across_faces(flow)
    less = ufl.min_value(gaps.pressure("+"), gaps.pressure("-")) - 1.0
    kink = avg(gaps.kink)
    more = sum(n("+")[i] ** 2 * kink[i] for i in range(len(v)))
    of_pressure = factors.ghost_pressure * h**3 / (flow.rho * avg(scales.phi)) * _jump(p, n) * _jump(q, n)
    return less * of_pressure + more * h * factors.ghost_viscous * flow.mu * dot(_jump(u, n), _jump(v, n))


def _across_faces(flow: Coefficients) -> tuple[Expr, Expr]:
    """Normal of a face, and the mean length of the cells beside it along the normal."""
    n = ufl.FacetNormal(flow.mesh)
    return n, avg(abs(sum(n[i] ** 2 * size for i, size in enumerate(flow.sizes))))


def _jump(field: Expr, n: Expr) -> Expr:
    """Jump of the normal derivative across a face, along the normal of its '+' side."""
    return dot(grad(field)("+") - grad(field)("-"), n("+"))
