"""Nitsche's method on the surfaces of bodies: all terms by which flow and surface act on each other.

For a flow (u, p) and a surface with the velocity g, with the test functions (v, q) and a virtual motion h of the
surface, the terms are

    N = -<2 mu eps(u) n - p n, v - h> - <u - g, 2 mu eps(v) n + q n> + <P (u - g), v - h>,   P = s I + s_n n n^T.

With t(u, g) = 2 mu eps(u) n - P (u - g) they read

    N = -<2 mu eps(u) n - p n, v> - <u, t(v, 0) + q n>      the flow's own block: `own`, for the form compiler
        + <g, t(v, 0) + q n>                                C
        + <t(u, g) - p n, h>                                less the force on the surface: C^T, the mass <P g, h>

Hence every operator of the surface (`interface.InterfaceTerms`) follows from P and the coefficients of t, `stress`.

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

#: Pieces that are evaluated together. Arrays at their quadrature points are large in 3D.
PIECES_AT_ONCE = 256


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


def at_compliant_surface(
    flow: Coefficients, n: Expr, P: Expr, D: Expr, w: Expr, u: Expr, p: Expr, v: Expr, q: Expr
) -> Expr:
    """Integrand of `at_surface` and of -<D t(u, g), t(v, 0)>."""
    return at_surface(flow, n, P, w, u, p, v, q) - dot(dot(D, traction(flow, n, P, w, u)), traction(flow, n, P, v, v))


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


def stress(mu: float | Array, n: Array, P: Array) -> Array:
    """Coefficients K of the traction t for a velocity phi e_k: t_i = sum_f K[f, k, i] (phi, grad phi)_f.

    mu [Pa s]; n: (pieces, dim); P: (pieces, dim, dim). Shape (pieces, 1 + dim, dim, dim).
    """
    identity = np.eye(n.shape[1])
    slope = np.einsum("pj,ki->pjki", n, identity) + np.einsum("pk,ij->pjki", n, identity)
    return np.concatenate([-P[:, None], np.reshape(mu, (-1, 1, 1, 1)) * slope], axis=1)


def compliance(c: Array, projector: Array, P: Array) -> Array:
    """D [m/Pa s] for the compliance c [m/Pa s], (pieces,), in the directions of projectors (pieces, dim, dim)."""
    s = np.einsum("pij,pij->p", P, projector) / np.einsum("pii->p", projector)
    with np.errstate(divide="ignore"):
        return (1.0 / (1.0 / c + s))[:, None, None] * projector


def released(
    mu: float | Array, n: Array, P: Array, D: Array, area: Array, table: tuple[Array, Array], sizes: Array
) -> Array:
    """-<D t(u), t(v)> by pieces, shape (pieces, functions, dim, functions, dim); zero where D is zero.

    area: int L_q, (pieces, points); table: values (points, functions) and reference gradients (points, functions, dim)
    at these points; sizes: edge lengths of the cells [m], (pieces, dim).
    """
    functions, dim = table[0].shape[1], n.shape[1]
    block = np.zeros((len(n), functions, dim, functions, dim))
    gives, mu = np.flatnonzero(D.any(axis=(1, 2))), np.broadcast_to(mu, len(n))
    for some in (gives[first : first + PIECES_AT_ONCE] for first in range(0, len(gives), PIECES_AT_ONCE)):
        block[some] = _squares(mu[some], n[some], P[some], D[some], -area[some], table, sizes[some])
    return block


def _squares(mu: Array, n: Array, P: Array, D: Array, weight: Array, table: tuple[Array, Array], sizes: Array) -> Array:
    """int weight t(phi_b e_l) . D t(phi_a e_k), shape (pieces, a, k, b, l).

    t(phi_a e_k) = S_a e_k + n_k g_a with S_a = mu d_n phi_a - s phi_a and g_a = mu grad phi_a - s_n phi_a n.
    """
    dim, phi, grad = n.shape[1], table[0], mu[:, None, None, None] * table[1] / sizes[:, None, None, :]
    s_total = np.einsum("pi,pij,pj->p", n, P, n)
    s = (np.einsum("pii->p", P) - s_total) / (dim - 1)
    S = np.einsum("pqai,pi->pqa", grad, n) - s[:, None, None] * phi
    g = grad - ((s_total - s)[:, None] * n)[:, None, None, :] * phi[:, :, None]
    pieces, points, functions = S.shape
    Dg = (g.reshape(pieces, -1, dim) @ D).reshape(g.shape)
    weighted = np.swapaxes(weight[:, :, None] * S, 1, 2)
    mixed = (weighted @ Dg.reshape(pieces, points, -1)).reshape(pieces, functions, functions, dim)
    both = sum(np.swapaxes(weight[:, :, None] * g[..., i], 1, 2) @ Dg[..., i] for i in range(dim))
    block = np.einsum("pab,pkl->pakbl", weighted @ S, D) + np.einsum("pab,pk,pl->pakbl", both, n, n)
    block += np.einsum("pabk,pl->pakbl", mixed, n)
    block += np.einsum("pbal,pk->pakbl", mixed, n)
    return block
