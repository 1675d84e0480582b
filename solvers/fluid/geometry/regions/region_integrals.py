"""Integrals over regions of fluid in cells in 3D, and over regions on their faces, by Gauss' theorem; all at once."""

from __future__ import annotations

import math

import numpy as np
from scipy import sparse

from solvers.api import Array, Indices
from solvers.mesh.gauss import gauss
from solvers.mesh.lagrange import lagrange

#: Triangles whose integrals are computed together, to bound the memory.
REGION_TRIANGLES_AT_ONCE = 1024


def over_surfaces(points: Array, triangles: Array, owner: Indices, count: int) -> Array:
    """int (int_0^x l_a) l_b l_c n_x over triangles, added up by their owners, shape (count, c, b, a).

    triangles: corners in reference coordinates, shape (n, 3, 3); owner: of each, below `count`.
    """
    size = len(points)
    nodes, weights = gauss((3 * size + 1) // 2)
    s, t = np.meshgrid(nodes, nodes, indexing="ij")
    corner = np.stack([(1.0 - s), s * (1.0 - t), s * t], axis=2).reshape(-1, 3)
    weight = (np.multiply.outer(weights, weights) * s).ravel()
    total = np.zeros((count, size**3))
    for start in range(0, len(triangles), REGION_TRIANGLES_AT_ONCE):
        some = triangles[start : start + REGION_TRIANGLES_AT_ONCE]
        at = corner @ some
        p, q = some[:, 1] - some[:, 0], some[:, 2] - some[:, 0]
        twice = p[:, 1] * q[:, 2] - p[:, 2] * q[:, 1]
        first = integral_from_0(points, at[..., 0]) * (weight * twice[:, None])[..., None]
        y, z = (lagrange(points, at[..., axis]) for axis in (1, 2))
        across = (z[..., :, None] * y[..., None, :]).reshape(*at.shape[:2], size**2)
        total += _added(across.transpose(0, 2, 1) @ first, owner[start : start + REGION_TRIANGLES_AT_ONCE], count)
    return total.reshape((count, *(size,) * 3))


def over_faces(points: Array, chords: Array, of_chord: Indices, far: Array, of_far: Indices, count: int) -> Array:
    """int l_a l_b over regions of squares, shape (count, a, b): int_0^x l_a along their boundaries.

    chords: parts of the boundaries, shape (n, 2, 2); far: intervals of them where x = 1, shape (m, 2); of_chord,
    of_far: the region of each, below `count`.
    """
    nodes, weights = gauss(len(points) + 1)
    along = chords[:, 1] - chords[:, 0]
    at = chords[:, None, 0] + nodes[:, None] * along[:, None]
    first, second = integral_from_0(points, at[..., 0]), lagrange(points, at[..., 1])
    inside = np.einsum("sga,sgb,g,s->sab", first, second, weights, along[:, 1], optimize=True)
    size = far[:, 1] - far[:, 0]
    there = lagrange(points, far[:, :1] + nodes * size[:, None])
    edge = np.einsum("sgb,g,s->sb", there, weights, size, optimize=True)
    whole = integral_from_0(points, np.ones(1))[0]
    total = _added(inside, of_chord, count).reshape(count, len(points), len(points))
    return np.asarray(total + whole[:, None] * _added(edge, of_far, count)[:, None, :])


def integral_from_0(points: Array, x: Array) -> Array:
    """int_0^x l_a of the Lagrange polynomials on some points, along one more axis."""
    powers = np.arange(len(points))
    coefficients = np.linalg.inv(points[:, None] ** powers) / (powers + 1)[:, None]
    return np.asarray(np.cumprod(np.repeat(x[..., None], len(points), axis=-1), axis=-1) @ coefficients)


def _added(values: Array, owner: Indices, count: int) -> Array:
    """Sums of values by their owners, shape (count, values)."""
    matrix = sparse.csr_matrix((np.ones(len(owner)), (owner, np.arange(len(owner)))), shape=(count, len(owner)))
    return np.asarray(matrix @ values.reshape(len(values), math.prod(values.shape[1:])))
