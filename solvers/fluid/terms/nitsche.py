"""Nitsche's method on the surfaces of bodies: all terms by which flow and surface act on each other.

For a flow (u, p) and a surface with the velocity g, with the test functions (v, q) and a virtual motion h of the
surface, the terms are

    N = -<2 mu eps(u) n - p n, v - h> - <u - g, 2 mu eps(v) n + q n> + <P (u - g), v - h>,   P = s I + s_n n n^T.

With t(u, g) = 2 mu eps(u) n - P (u - g) they read

    N = -<2 mu eps(u) n - p n, v> - <u, t(v, 0) + q n>      the flow's own block: `own`, for the form compiler
        + <g, t(v, 0) + q n>                                C
        + <t(u, g) - p n, h>                                less the force on the surface: C^T, the mass <P g, h>

Hence every operator of the surface (`interface.InterfaceTerms`) is a part of N's derivatives, `surface_terms`.

Compliant conditions, u - g = -c t in the directions of a projector, describe slip along the surface (c = b / mu with
the slip length b) and seepage into it. They need one more term, -<D t(u, g), t(v, -h)> with D = projector / (1 / c + s)
and s the penalty in these directions. It is consistent for every c from 0 (no slip) to infinity (no stress), and all
blocks stay symmetric. With R = I - D P it replaces t by R t in C, and P by P R in the mass. The flow's own block gets
`released`.
Sources: Massing, Schott, Wall, Comput. Methods Appl. Mech. Engrg. 328 (2018) 262-300, section 3; Juntunen, Stenberg,
Math. Comp. 78 (2009) 1353-1374.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from ufl import dot

from solvers.api import Array
from solvers.fluid.settings.penalties import TRACE, Penalties
from solvers.fluid.terms.forms import Coefficients, Expr, viscous_stress


def own(flow: Coefficients, weights: Any, u: Expr, p: Expr, v: Expr, q: Expr) -> Expr:
    """Integrand over cut cells of the flow's own block; `weights` has the moments of n and P as coefficients."""
    return at_surface(flow, weights.n, weights.penalty, u, u, p, v, q)


def at_surface(flow: Coefficients, n: Expr, P: Expr, w: Expr, u: Expr, p: Expr, v: Expr, q: Expr) -> Expr:
    """Integrand -(t - p n) . v - w . (2 mu eps(v) n + q n) with w = u - g and t = 2 mu eps(u) n - P w: of N for h = 0.

    It is linear in n and P, which may be moments.
    """
    return -dot(traction(flow, n, P, w, u) - p * n, v) - dot(w, dot(viscous_stress(flow, v), n)) - q * dot(w, n)


def traction(flow: Coefficients, n: Expr, P: Expr, w: Expr, u: Expr) -> Expr:
    """t = 2 mu eps(u) n - P w."""
    return dot(viscous_stress(flow, u), n) - dot(P, w)


def released(flow: Coefficients, n: Expr, P: Expr, D: Expr, w: Expr, u: Expr, v: Expr) -> Expr:
    """Integrand -<D t(u, g), t(v, 0)>."""
    return -dot(dot(D, traction(flow, n, P, w, u)), traction(flow, n, P, v, v))


def penalties(
    flow: tuple[float | Array, float, float],
    factors: Penalties,
    degree: int,
    n: Array,
    sizes: Array,
    speed: Array,
    g: Array,
    reduced: Array | float = 1.0,
    least: Array | float = 0.0,
) -> Array:
    """P = s I + s_n n n^T of pieces [Pa s/m], shape (pieces, dim, dim).

    s = mu max(gamma C_T / (r h), c) + rho max(0, -g . n), s_n = rho (gamma_b |a| + gamma_t h alpha) with
    h = (sum n_i^2 / h_i^2)^(-1/2), the length of a cell along the normal, r: `reduced`, in gaps of less than a cell, c:
    `least` [1/m], in films.
    flow: mu [Pa s] (by pieces if it varies), rho [kg/m^3], alpha [1/s]; n, edge lengths of the cells [m], g [m/s]:
    (pieces, dim); speed: |a| [m/s], (pieces,).
    """
    mu, rho, alpha = flow
    viscous = np.maximum(viscous_penalty(factors, degree, n, sizes, reduced), least)
    s = mu * viscous + rho * np.maximum(0.0, -np.einsum("pi,pi->p", g, n))
    normal = rho * factors.convection * speed + slip_mass(rho, factors, n, sizes) * alpha
    return s[:, None, None] * np.eye(n.shape[1]) + normal[:, None, None] * n[:, :, None] * n[:, None, :]


def viscous_penalty(factors: Penalties, degree: int, n: Array, sizes: Array, reduced: Array | float = 1.0) -> Array:
    """gamma C_T / (r h) of pieces [1/m], (pieces,); see `penalties`."""
    penalty: Array = factors.nitsche * TRACE[n.shape[1], degree] / reduced * np.linalg.norm(n / sizes, axis=1)
    return penalty


def slip_mass(rho: float, factors: Penalties, n: Array, sizes: Array) -> Array:
    """rho gamma_t h of pieces [kg/m^2], (pieces,): the inertia of the slip along the normal; see `penalties`."""
    mass: Array = rho * factors.mass / np.linalg.norm(n / sizes, axis=1)
    return mass


def compliance(c: Array, projector: Array, P: Array) -> Array:
    """D [m/Pa s] for the compliance c [m/Pa s], (pieces,), in the directions of projectors (pieces, dim, dim)."""
    s = np.einsum("pij,pij->p", P, projector) / np.einsum("pii->p", projector)
    with np.errstate(divide="ignore"):
        return (1.0 / (1.0 / c + s))[:, None, None] * projector
