"""Where surfaces of films cross planes of the grid: what leaves the integral over a piece as the surface moves.

The integrand f of a film jumps between cells. A displacement dd of the surface moves the line along which it crosses a
plane with the normal e (out of the cell), so that the integral over the piece in the cell changes by

    d int f ds = ... - int_line f e . dd / s dl,   s = |(I - n n^T) e|,

a point in 2D. The sum over the cells at the plane has the jump of f, which is zero for continuous integrands.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.grid.box import FLUSH, Grid
from solvers.mesh.gauss import gauss
from solvers.mesh.tessellation import unit_normals

#: Gauss points on a line: exact for a basis of degree 4 in two directions and barycentric coordinates.
ON_LINE = 5

#: Difference of unit normals that is rounding error.
SAME_NORMAL = 1e-9


def open_sides(grid: Grid, number: NDArray[np.int64], creeping: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether a cell with creeping flow is beyond each plane of some cells, shape (cells, dim, 2).

    Beyond other planes the formula of `shape` holds, which has no jump. Planes of the box do not count: where a film
    ends at such a wall they are nearly parallel to its surface, s is small, and the line moves through the whole film
    within an iterate.
    """
    index = np.stack(np.unravel_index(number, grid.shape, order="F"), axis=1)
    found = np.zeros((*index.shape, 2), dtype=bool)
    for axis in range(grid.dim):
        for side, step in enumerate((-1, 1)):
            there = index.copy()
            there[:, axis] += step
            inside = (there[:, axis] >= 0) & (there[:, axis] < grid.shape[axis])
            beyond = np.ravel_multi_index(tuple(there[inside].T), grid.shape, order="F")
            found[inside, axis, side] = creeping[beyond]
    return found


def crossing_moments(
    x: Array, n: Array, origin: Array, sizes: Array, reference: Array, sides: NDArray[np.bool_]
) -> Array:
    """int_line L_q lambda_b e_j / s dl of pieces, summed over the planes; shape (pieces, vertices, points, dim).

    x: corners of the facets, (pieces, dim, dim); n: unit normals; origin, sizes: of the cells, (pieces, dim);
    reference: points of L_q, (points, dim); sides: planes that count, (pieces, dim, 2).
    Pieces with another normal than their facet cross no planes: ends of what is closed lie in planes themselves.
    """
    pieces, dim = n.shape
    nodes = gauss(len(np.unique(reference[:, 0].round(12))))[0]
    place = np.abs(reference[:, :, None] - nodes).argmin(axis=2)
    found = np.zeros((pieces, dim, len(reference), dim))
    t, weights = gauss(ON_LINE) if dim == 3 else (np.zeros(1), np.ones(1))
    local = (x - origin[:, None]) / sizes[:, None]
    facing = unit_normals(x)
    facing *= np.sign((n * facing).sum(axis=1))[:, None]
    own = np.abs(n - facing).max(axis=1, initial=0.0) < SAME_NORMAL
    for axis in range(dim):
        for side in (0, 1):
            some, ends = _line(local[:, :, axis] - side, own & sides[:, axis, side])
            # barycentric coordinates of both ends, and the part of the line between them that is in the cell
            first, last = _inside(ends, local[some], axis)
            kept = last > first
            some, ends, first, last = some[kept], ends[kept], first[kept], last[kept]
            if not len(some):
                continue
            at = first[:, None] + (last - first)[:, None] * t
            lam = ends[:, :1] + at[..., None] * (ends[:, 1:] - ends[:, :1])
            points = lam @ local[some]
            basis = np.ones((*at.shape, len(reference)))
            for k in range(dim):
                basis *= _lagrange(nodes, points[..., k])[..., place[:, k]]
            length = np.ones(len(some))
            if dim == 3:
                along = np.einsum("nb,nbi->ni", ends[:, 1] - ends[:, 0], x[some])
                length = (last - first) * np.linalg.norm(along, axis=1)
            steepness = np.linalg.norm(np.delete(n[some], axis, axis=1), axis=1)
            scale = (2 * side - 1) * length / steepness
            found[some, :, :, axis] += np.einsum("n,l,nlq,nlb->nbq", scale, weights, basis, lam)
    return found


def barycentric(points: Array, x: Array) -> Array:
    """Barycentric coordinates (pieces, points, vertices) in facets (pieces, vertices, dim), constant along normals."""
    edges, away = x[:, 1:] - x[:, :1], points - x[:, :1]
    inner = np.swapaxes(np.linalg.solve(edges @ np.swapaxes(edges, 1, 2), edges @ np.swapaxes(away, 1, 2)), 1, 2)
    return np.concatenate([1.0 - inner.sum(axis=2, keepdims=True), inner], axis=2)


def _line(height: Array, counts: NDArray[np.bool_]) -> tuple[NDArray[np.int64], Array]:
    """Facets that a plane crosses, and barycentric coordinates of the ends of the line, shape (facets, 2, vertices).

    height: of the vertices above the plane [cells], (facets, vertices); a vertex on the plane counts as above. Facets
    in the plane, up to rounding, do not cross it.
    """
    above = height >= 0.0
    some = np.flatnonzero(counts & above.any(axis=1) & ~above.all(axis=1) & (np.abs(height) > FLUSH).any(axis=1))
    h, up = height[some], above[some]
    vertices = h.shape[1]
    lone = np.where(up.sum(axis=1) == 1, up.argmax(axis=1), (~up).argmax(axis=1))
    ends = np.zeros((len(some), 2, vertices))
    each = np.arange(len(some))
    for end in (0, 1):
        other = (lone + 1 + (end if vertices == 3 else 0)) % vertices
        share = h[each, lone] / (h[each, lone] - h[each, other])
        ends[each, end, lone] = 1.0 - share
        ends[each, end, other] = share
    return some, ends


def _inside(ends: Array, local: Array, axis: int) -> tuple[Array, Array]:
    """Where lines enter and leave the cell [0, 1]^dim, from 0 to 1 along them; leave < enter if they miss it."""
    first, last = np.zeros(len(ends)), np.ones(len(ends))
    a, b = (np.einsum("nb,nbi->ni", ends[:, k], local) for k in (0, 1))
    for k in range(local.shape[2]):
        if k == axis:
            continue
        way = b[:, k] - a[:, k]
        within, still = (a[:, k] >= 0.0) & (a[:, k] < 1.0), way == 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            low, high = -a[:, k] / way, (1.0 - a[:, k]) / way
        low = np.where(still, np.where(within, 0.0, np.inf), low)
        high = np.where(still, np.where(within, 1.0, np.inf), high)
        first, last = np.maximum(first, np.minimum(low, high)), np.minimum(last, np.maximum(low, high))
    return first, last


def _lagrange(nodes: Array, s: Array) -> Array:
    """Lagrange polynomials on the nodes at s, along one more axis."""
    found = np.ones((*s.shape, len(nodes)))
    for i, node in enumerate(nodes):
        for k, other in enumerate(nodes):
            if k != i:
                found[..., i] *= (s - other) / (node - other)
    return found
