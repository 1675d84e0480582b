"""The terms at pieces of surface with what their derivative by the motion of the surface needs, from their forms.

Of an integrand f: f, its slope with the velocity g of the surface held, and df/dn, along one axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid.terms import forms
from solvers.fluid.terms.interface import InterfaceTerms
from solvers.fluid.terms.shape_derivatives.film_crossings import barycentric
from solvers.fluid.terms.surface_terms import Piecewise, along_normal, side_by_side, surface, symbols

#: Numbers of a piece beside its normal: s and s_n of `nitsche.penalties`, the traction of slip in earlier steps, D
#: along the normal and along the surface, and kappa / mu of a layer, which alone does not change as surfaces move.
PARAMETERS = 6


class FilmIntegrands:
    """f at points of cut cells: by test functions of the flow, and the force per area."""

    def __init__(self, domain: fem.Domain, flow: forms.Coefficients, parts: Sequence[Any], points: Array):
        """flow: coefficients in cut cells; parts: u, p, v and q; points: of cut cells."""
        self._domain, self._flow, self._parts, self._points = domain, flow, parts, points

    @cached_property
    def _built(self) -> tuple[Any, fem.Pointwise, fem.Pointwise]:
        """(numbers of pieces, rows, force)."""
        domain, flow, (u, p, v, q), dim = self._domain, self._flow, self._parts, self._domain.dim
        numbers, (n, parameters, origin, g, slope, force, zero) = symbols(
            domain, (dim,), (PARAMETERS,), (dim,), (dim,), (dim, dim), (dim,), (1,)
        )
        n, force, parameters = ufl.variable(n), ufl.variable(force), ufl.variable(parameters)
        g = ufl.variable(g + ufl.dot(slope, ufl.SpatialCoordinate(domain.mesh) - origin))
        terms = flow, n, parameters, u - g, u, p
        on_rows, on_force = _surface(*terms, v, q), ufl.diff(_surface(*terms, force, zero[0]), force)
        what = "the derivative of films"
        moved = (_moved(f, n, frozen=(g, slope)) + _by_penalty(f, parameters) for f in (on_rows, on_force))
        rows, force = (fem.Pointwise(domain, ufl.as_vector(part), self._points, what) for part in moved)
        return numbers, rows, force

    def compile(self) -> None:
        """Compile what is not yet (collective)."""
        for part in self._built[1:]:
            part.compile()

    def on(self, at: InterfaceTerms, some: NDArray[np.int64], origin: Array, g: Array) -> tuple[Array, Array]:
        """Rows and force of some pieces, (pieces, points, 2 + 2 dim, rows or components); df/ds last.

        origin: of their cells [m], (pieces, dim); g: velocity of the surface at their corners [m/s].
        """
        dim, sizes, (symbols, *parts) = at.dim, at.sizes[some], self._built
        ends = np.concatenate([np.zeros((1, dim)), np.eye(dim)])
        there = barycentric(origin[:, None] + ends * sizes[:, None], at.x[some]) @ g
        slope = np.swapaxes(there[:, 1:] - there[:, :1], 1, 2) / sizes[:, None]
        numbers = [
            *_numbers(at.surface, some, np.zeros(len(g))),
            origin,
            there[:, 0],
            slope,
            np.zeros((len(g), dim + 1)),
        ]
        rows, force = (part.on(at.cell[some], {symbols: side_by_side(numbers)}) for part in parts)
        return rows, force.reshape(*rows.shape[:3], dim)


class MeanIntegrands:
    """f with fields and test functions averaged over pieces, u = u_m + grad u_m (x - x_m), and df/d(parameters)."""

    def __init__(self, domain: fem.Domain, flow: forms.Coefficients):
        """flow: coefficients in cut cells."""
        self._domain, self._flow = domain, flow

    @cached_property
    def _built(self) -> tuple[Any, fem.Pointwise]:
        """(numbers of pieces, the derivatives)."""
        domain, flow, dim = self._domain, self._flow, self._domain.dim
        vector, tensor = (dim,), (dim, dim)
        numbers, (n, parameters, x, w, p, du, dp, tests, dv) = symbols(
            domain, vector, (PARAMETERS,), vector, vector, (1,), tensor, vector, (2 * dim + 1,), tensor
        )
        n, parameters, tests, dv = (ufl.variable(part) for part in (n, parameters, tests, dv))
        away = ufl.SpatialCoordinate(domain.mesh) - x
        v, dq = (ufl.as_vector([tests[first + i] for i in range(dim)]) for first in (0, dim + 1))
        w, q = w + ufl.dot(du, away), tests[dim] + ufl.dot(dq, away)
        f = _surface(flow, n, parameters, w, w, p[0] + ufl.dot(dp, away), v + ufl.dot(dv, away), q)
        moved, of_dv, each = _moved(ufl.diff(f, tests), n, parameters=parameters), ufl.diff(f, dv), range(dim)
        slopes = [ufl.grad(of_dv[i, k])[j] for k in each for i in each for j in each]
        what = "the flow's derivative by the motion of surfaces"
        return numbers, fem.Pointwise(domain, ufl.as_vector([*moved, *slopes]), np.zeros((1, dim)), what)

    def on(self, at: InterfaceTerms, origin: Array, inertia: Array, means: Array, slopes: Array) -> tuple[Array, Array]:
        """The derivatives for constant test functions, and for linear ones of momentum.

        Returns those for e_i of momentum and 1 and x_k of continuity, (pieces, 2 dim + PARAMETERS, 2 dim + 1), and the
        slopes for x_k e_i of momentum, (pieces, k, i, dim).
        origin: of the cells of pieces [m], (pieces, dim); inertia: traction of slip in earlier steps [Pa]; means: of
        u - g and p, (pieces, dim + 1); slopes: of u and p, (pieces, dim + 1, dim).
        """
        pieces, dim = origin.shape
        parts, tests = 2 * dim + PARAMETERS, 2 * dim + 1
        numbers = [
            *_numbers(at.surface, slice(None), inertia),
            origin,
            means,
            slopes,
            np.zeros((pieces, tests + dim**2)),
        ]
        symbols, pointwise = self._built
        found = pointwise.on(at.cell, {symbols: side_by_side(numbers)})[:, 0]
        return (
            found[:, : parts * tests].reshape(pieces, parts, tests),
            found[:, parts * tests :].reshape(pieces, dim, dim, dim),
        )


def _surface(flow: forms.Coefficients, n: Any, parameters: Any, w: Any, u: Any, p: Any, v: Any, q: Any) -> Any:
    """Integrand of all terms of a surface; w = u - g."""
    s, s_n, inertia, d_n, d_t, mobility = (parameters[k] for k in range(PARAMETERS))
    along, identity = ufl.outer(n, n), ufl.Identity(len(n))
    P, D = s * identity + s_n * along, d_n * along + d_t * (identity - along)
    return surface(flow, n, P, D, mobility, w, u, p, v, q) - inertia * ufl.dot(n, v)


def _numbers(at: Piecewise, some: NDArray[np.int64] | slice, inertia: Array) -> list[Array]:
    """Normals and parameters of some pieces."""
    n = at.n[some]
    (s_total, s), (d_n, d_t) = (along_normal(part[some], n) for part in (at.penalty, at.released))
    mobility = np.zeros(len(n)) if at.mobility is None else at.mobility[some]
    return [n, np.stack([s, s_total - s, inertia, d_n, d_t, mobility], axis=1)]


def _moved(f: Any, n: Any, frozen: tuple[Any, Any] | None = None, parameters: Any = None) -> list[Any]:
    """f, its slope, df/dn and that by `parameters`, one after the other; frozen: a variable and its slope in f."""
    dim, found = len(n), []
    for part in _components(f):
        along = [ufl.grad(part)[j] for j in range(dim)]
        if frozen is not None:
            along = [of_f - ufl.dot(ufl.diff(part, frozen[0]), frozen[1][:, j]) for j, of_f in enumerate(along)]
        found.append([part, *along, *(ufl.diff(part, n)[k] for k in range(dim))])
        if parameters is not None:
            found[-1] += [ufl.diff(part, parameters)[k] for k in range(PARAMETERS - 1)]
    return [value for values in zip(*found, strict=True) for value in values]


def _components(f: Any) -> list[Any]:
    return [f[i] for i in range(len(f))] if f.ufl_shape else [f]


def _by_penalty(f: Any, parameters: Any) -> list[Any]:
    """df/ds; D = 1 / (1 / c + s) in each direction changes, too."""
    found = []
    for part in _components(f):
        by = ufl.diff(part, parameters)
        found.append(by[0] - parameters[3] ** 2 * by[3] - parameters[4] ** 2 * by[4])
    return found
