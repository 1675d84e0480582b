"""The sign of the Jacobian determinant in all points of cells, by its Bernstein coefficients.

The determinant is a polynomial. It is at least the smallest of its Bernstein coefficients, and at corners equal to one
of them. Where that leaves its sign open, the cell is halved along all axes, up to `HALVINGS_OF_CELL` times.
Source: Johnen, Remacle, Geuzaine, Geometrical validity of curvilinear finite elements, J. Comput. Phys. 233 (2013).
"""

from __future__ import annotations

from functools import cache
from itertools import product
from math import comb, factorial

import numpy as np
from numpy.typing import NDArray

from solvers.api import EPS
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.locate import shape_functions
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import determinant

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: After these the coefficients differ from the determinant by less than 4^-8 = 2e-5 of its curvature.
HALVINGS_OF_CELL = 8

#: Cells whose determinants are computed at once.
CELLS_AT_ONCE = 2048


def inverted(mesh: Mesh) -> Indices:
    """Cells whose determinant is negative somewhere, or in doubt after all halvings, shape (k,).

    Zero, as at a corner where edges are parallel or nodes coincide, is allowed up to the rounding of positions.
    """
    points, to_coefficients, halves = _polynomials(mesh.cell_type)
    gradients = shape_functions(mesh.cell_type, points)[1]
    growth = float(np.abs(to_coefficients).sum(axis=1).max())
    found = []
    for start in range(0, len(mesh.cells), CELLS_AT_ONCE):
        x = mesh.points[mesh.cells[start : start + CELLS_AT_ONCE]]
        rounding = growth * _rounding(x)
        coefficients = _determinants(x, gradients) @ to_coefficients.T
        doubtful = np.flatnonzero(~(coefficients.min(axis=1) >= -rounding))
        if len(doubtful):
            wrong = _decide(coefficients[doubtful], rounding[doubtful], to_coefficients, halves)
            found.append(start + doubtful[wrong])
    return np.concatenate([np.empty(0, dtype=np.int64), *found])


def middle_maps(mesh: Mesh) -> tuple[Array, Array]:
    """(middles of the cells [m] (cells, dim), inverse Jacobians there (cells, dim, dim)), infinite without volume."""
    x = mesh.points[mesh.cells]
    values, gradients = shape_functions(mesh.cell_type, CELL_TYPES[mesh.cell_type].middle[None])
    jacobian = _jacobians(x, gradients)[:, 0]
    return np.einsum("a,cai->ci", values[0], x), inverses(jacobian)


def inverses(jacobian: Array) -> Array:
    """Inverses of matrices (n, dim, dim), infinite where there are none."""
    size = determinant(jacobian)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = _adjugate(jacobian) / size[:, None, None]
    inverse[size == 0.0] = np.inf
    return np.asarray(inverse)


def _rounding(x: Array) -> Array:
    """Bound of the error of a determinant by rounded positions and sums, of nodes (cells, nodes, dim)."""
    dim = x.shape[2]
    size = np.ptp(x, axis=1).max(axis=1)
    return 4.0 * factorial(dim) * EPS * size ** (dim - 1) * (np.abs(x).max(axis=(1, 2)) + size)


def _decide(coefficients: Array, rounding: Array, to_coefficients: Array, halves: Array) -> NDArray[np.bool_]:
    """Which of the doubtful cells are wrong: some coefficient stays negative, or the value at a corner is."""
    corners = np.flatnonzero((np.abs(to_coefficients) > 1e-9).sum(axis=1) == 1)  # the polynomial's values at corners
    wrong = np.zeros(len(coefficients), dtype=bool)
    cell, parts = np.arange(len(coefficients)), coefficients
    for _ in range(HALVINGS_OF_CELL):
        wrong[cell[(parts[:, corners] < -rounding[cell, None]).any(axis=1)]] = True
        left = ~wrong[cell] & (parts.min(axis=1) < -rounding[cell])
        cell, parts = cell[left], parts[left]
        if not len(cell):
            return wrong
        parts = np.einsum("hij,cj->chi", halves, parts).reshape(-1, parts.shape[1])
        cell = np.repeat(cell, len(halves))
    wrong[cell[parts.min(axis=1) < -rounding[cell]]] = True
    return wrong


def _jacobians(x: Array, gradients: Array) -> Array:
    """dx_i/dxi_j of nodes (cells, nodes, dim) at points, shape (cells, points, dim, dim)."""
    cells, nodes, dim = x.shape
    flat = gradients.transpose(1, 0, 2).reshape(nodes, -1)
    local = (x - x[:, :1]).transpose(0, 2, 1).reshape(-1, nodes) @ flat
    return local.reshape(cells, dim, -1, dim).transpose(0, 2, 1, 3)


def _determinants(x: Array, gradients: Array) -> Array:
    return determinant(_jacobians(x, gradients))


def _adjugate(j: Array) -> Array:
    """The inverse times the determinant."""
    if j.shape[-1] == 2:
        return np.stack([j[..., 1, 1], -j[..., 0, 1], -j[..., 1, 0], j[..., 0, 0]], axis=-1).reshape(j.shape)
    m, after = np.moveaxis(j, (-2, -1), (0, 1)), (1, 2, 0)
    entries = [
        [
            m[after[k], after[i]] * m[after[after[k]], after[after[i]]]
            - m[after[k], after[after[i]]] * m[after[after[k]], after[i]]
            for k in range(3)
        ]
        for i in range(3)
    ]
    return np.moveaxis(np.array(entries), (0, 1), (-2, -1))


@cache
def _polynomials(cell_type: str) -> tuple[Array, Array, Array]:
    """(points, matrix from values there to Bernstein coefficients, matrices to those of the halves of a cell)."""
    kind = CELL_TYPES[cell_type]
    dim, simplex = kind.reference_nodes.shape[1], kind.shape.simplex
    degree = dim * (kind.degree - 1) if simplex else dim * kind.degree - 1
    exponents = np.array([e for e in product(range(degree + 1), repeat=dim) if not simplex or sum(e) <= degree])
    points = exponents / degree if degree else np.full((1, dim), 1.0 / (dim + 1))
    to_coefficients = np.linalg.inv(_bernstein(points, exponents, degree, simplex))
    starts, maps = _halves(dim, simplex)
    halves = [
        to_coefficients @ _bernstein(start + points @ to_half.T, exponents, degree, simplex)
        for start, to_half in zip(starts, maps, strict=True)
    ]
    return points, to_coefficients, np.array(halves)


def _bernstein(points: Array, exponents: Indices, degree: int, simplex: bool) -> Array:
    """Bernstein's polynomials at points, shape (points, polynomials)."""
    if simplex:
        powers = np.concatenate([degree - exponents.sum(axis=1, keepdims=True), exponents], axis=1)
        share = np.concatenate([1.0 - points.sum(axis=1, keepdims=True), points], axis=1)
        shares = np.array([factorial(degree) / np.prod([factorial(int(k)) for k in row]) for row in powers])
        return np.asarray(shares * np.prod(share[:, None, :] ** powers, axis=2))
    factor = np.array([np.prod([comb(degree, int(k)) for k in row]) for row in exponents])
    x = points[:, None, :]
    return np.asarray(factor * np.prod(x**exponents * (1.0 - x) ** (degree - exponents), axis=2))


def _halves(dim: int, simplex: bool) -> tuple[list[Array], list[Array]]:
    """(first corners, edges as columns) of the parts of the unit cell, halved along all axes."""
    if not simplex:
        starts = [0.5 * np.array(corner, dtype=float) for corner in product((0, 1), repeat=dim)]
        return starts, [0.5 * np.eye(dim)] * len(starts)
    corners = np.concatenate([np.zeros((1, dim)), np.eye(dim)])
    middle = 0.5 * (corners[:, None] + corners[None])
    parts: list[tuple[Array, ...]]
    if dim == 2:
        parts = [(middle[i, i], middle[i, j], middle[i, k]) for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
        parts.append((middle[1, 2], middle[2, 0], middle[0, 1]))
    else:
        parts = [tuple(middle[i, j] for j in (i, *(k for k in range(4) if k != i))) for i in range(4)]
        axis = middle[0, 1], middle[2, 3]  # the octahedron that is left, in four parts around one of its axes
        around = [middle[0, 2], middle[1, 2], middle[1, 3], middle[0, 3]]
        parts += [(*axis, around[i], around[(i + 1) % 4]) for i in range(4)]
    return [part[0] for part in parts], [np.stack([x - part[0] for x in part[1:]], axis=1) for part in parts]
