"""All terms of a surface as one declaration, and the coefficients by which its operators multiply fields at a point.

With the fields F = (u, grad u, p, grad p, g) and the test functions T = (v, grad v, q, grad q) the declaration S(F, T)
of `nitsche` and `seepage` is bilinear. At a piece of surface every operator of `interface` is a part of d2S / dT dF,
which the form compiler derives.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import ufl

from solvers import fem
from solvers.api import Array, Indices32
from solvers.fluid.terms import forms, nitsche, seepage


def surface(
    flow: forms.Coefficients, n: Any, P: Any, D: Any, mobility: Any, w: Any, u: Any, p: Any, v: Any, q: Any
) -> Any:
    """Integrand of all terms of a surface but the traction of slip in earlier steps; w = u - g."""
    own = nitsche.at_surface(flow, n, P, w, u, p, v, q)
    return own + beside(flow, n, P, D, mobility, w, u, p, v, q)


def beside(
    flow: forms.Coefficients, n: Any, P: Any, D: Any, mobility: Any, w: Any, u: Any, p: Any, v: Any, q: Any
) -> Any:
    """Those that moments of n and P do not determine: of slip and layers."""
    return nitsche.released(flow, n, P, D, w, u, v) + seepage.layer(mobility, n, p, q)


@dataclass(frozen=True)
class Piecewise:
    """What pieces have for `surface`."""

    cell: Indices32  #: local
    n: Array  #: unit normals into the solid, (pieces, dim)
    penalty: Array  #: P [Pa s/m], (pieces, dim, dim)
    released: Array  #: D [m/Pa s], (pieces, dim, dim)
    mobility: Array | None  #: kappa / mu of a layer [m^3/Pa s]


class SurfaceOperators:
    """Coefficients d2S / dT dF of pieces. Shapes as in `interface.MotionOperator`."""

    def __init__(self, domain: fem.Domain, flow: forms.Coefficients):
        """flow: coefficients in cut cells."""
        self._domain, self._flow = domain, flow

    def _fields(self) -> tuple[Any, list[Any], list[Any]]:
        """(numbers, variables u, grad u, p, grad p, g, v, grad v, q, grad q, arguments of `surface`)."""
        domain, dim = self._domain, self._domain.dim
        vector, tensor = (dim,), (dim, dim)
        numbers, (origin, n, P, D, mobility) = symbols(domain, vector, vector, tensor, tensor, (1,))
        # the second derivative is the same at any fields
        of_fields = vector, tensor, (1,), vector, vector, vector, tensor, (1,), vector
        u, du, p, dp, g, v, dv, q, dq = variables = [ufl.variable(ufl.zero(*shape)) for shape in of_fields]
        away = ufl.SpatialCoordinate(domain.mesh) - origin
        at, test = u + ufl.dot(du, away), v + ufl.dot(dv, away)
        flow = [at - g, at, p[0] + ufl.dot(dp, away), test, q[0] + ufl.dot(dq, away)]
        return numbers, variables, [n, P, D, mobility[0], *flow]

    def _pointwise(self, found: list[Any]) -> fem.Pointwise:
        return fem.Pointwise(self._domain, ufl.as_vector(found), np.zeros((1, self._domain.dim)), "terms of surfaces")

    @cached_property
    def _motion(self) -> tuple[Any, fem.Pointwise]:
        """By g, of momentum and continuity, and of the force dS/dv by u, grad u and p."""
        numbers, (u, du, p, _, g, v, dv, q, _), given = self._fields()
        S, each = surface(self._flow, *given), range(self._domain.dim)
        of_v, of_dv, of_q = (ufl.diff(S, test) for test in (v, dv, q))
        rows = [of_v[k] for k in each] + [of_dv[k, j] for j in each for k in each] + [of_q[0]]
        by_g = [ufl.diff(row, g)[i] for row in rows for i in each]
        by_u = [ufl.diff(of_v[i], u)[k] for k in each for i in each]
        by_slope = [ufl.diff(of_v[i], du)[k, j] for j in each for k in each for i in each]
        return numbers, self._pointwise([*by_g, *by_u, *by_slope, *(ufl.diff(of_v[i], p)[0] for i in each)])

    @cached_property
    def _beside(self) -> tuple[Any, fem.Pointwise]:
        """Of `beside`, momentum by u and grad u, and the slope of continuity by grad p."""
        numbers, (u, du, _, dp, _, v, dv, _, dq), given = self._fields()
        S, each = beside(self._flow, *given), range(self._domain.dim)
        momentum = []
        for row in [ufl.diff(S, v)[k] for k in each] + [ufl.diff(S, dv)[k, j] for j in each for k in each]:
            by_u, by_slope = ufl.diff(row, u), ufl.diff(row, du)
            momentum += [by_u[k] for k in each] + [by_slope[k, j] for j in each for k in each]
        return numbers, self._pointwise([*momentum, *(ufl.diff(ufl.diff(S, dq)[i], dp)[j] for i in each for j in each)])

    def motion(self, at: Piecewise, origin: Array) -> tuple[Array, Array, Array, Array]:
        """(of momentum by g, (pieces, fields, component, motion), of continuity by g, (pieces, motion), the force's by

        fields of u, (pieces, fields, component, force), and by p, (pieces, force)). origin: of cells, (pieces, dim).
        """
        pieces, dim = origin.shape
        found, size = self._on(self._motion, at, origin), (1 + dim) * dim**2
        ends = np.cumsum([size, dim, size])
        by_g, leak, by_u, by_p = np.split(found, ends, axis=1)
        shape = pieces, 1 + dim, dim, dim
        return by_g.reshape(shape), leak, by_u.reshape(shape), by_p

    def beside(self, at: Piecewise, origin: Array) -> tuple[Array, Array]:
        """Of slip and layers: of momentum by u, and of continuity by p, (pieces, fields, k, fields, l)."""
        pieces, dim = origin.shape
        found, size = self._on(self._beside, at, origin), ((1 + dim) * dim) ** 2
        momentum, slopes = np.split(found, [size], axis=1)
        of_p = np.zeros((pieces, 1 + dim, 1, 1 + dim, 1))
        of_p[:, 1:, 0, 1:, 0] = slopes.reshape(pieces, dim, dim)
        return momentum.reshape(pieces, 1 + dim, dim, 1 + dim, dim), of_p

    def _on(self, built: tuple[Any, fem.Pointwise], at: Piecewise, origin: Array) -> Array:
        mobility = np.zeros(len(origin)) if at.mobility is None else at.mobility
        numbers = side_by_side([origin, at.n, at.penalty, at.released, mobility[:, None]])
        found: Array = built[1].on(at.cell, {built[0]: numbers})[:, 0]
        return found


def symbols(domain: fem.Domain, *shapes: tuple[int, ...]) -> tuple[Any, list[Any]]:
    """(numbers of cells, vectors and matrices of them)."""
    ends = np.cumsum([0, *(np.prod(shape) for shape in shapes)])
    numbers, found = fem.numbers_of_cells(domain, int(ends[-1])), []
    for shape, first in zip(shapes, ends.tolist(), strict=False):
        if len(shape) == 1:
            found.append(ufl.as_vector([numbers[first + i] for i in range(shape[0])]))
        else:
            rows = range(first, first + shape[0] * shape[1], shape[1])
            found.append(ufl.as_matrix([[numbers[row + j] for j in range(shape[1])] for row in rows]))
    return numbers, found


def side_by_side(numbers: list[Array]) -> Array:
    """Values of `symbols`."""
    return np.concatenate([part.reshape(len(part), int(np.prod(part.shape[1:]))) for part in numbers], axis=1)


def along_normal(values: Array, n: Array) -> tuple[Array, Array]:
    """a and b of matrices a n n^T + b (I - n n^T), (pieces, dim, dim)."""
    normal = np.einsum("pk,pkl,pl->p", n, values, n)
    return normal, (np.einsum("pkk->p", values) - normal) / (n.shape[1] - 1)
