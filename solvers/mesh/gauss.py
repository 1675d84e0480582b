"""Gauss points of the unit interval, and weights of their tensor products."""

from __future__ import annotations

from functools import cache

import numpy as np

from solvers.api import Array


@cache
def gauss(points: int) -> tuple[Array, Array]:
    """(points, weights) on [0, 1], exact for polynomials of degree 2 points - 1; the arrays are read-only."""
    x, weights = np.polynomial.legendre.leggauss(points)
    found = 0.5 * x + 0.5, 0.5 * weights
    for array in found:
        array.setflags(write=False)
    return found


def tensor_weights(points: int, dim: int) -> Array:
    """Weights of the tensor Gauss rule on [0, 1]^dim with so many points in each direction."""
    weights = gauss(points)[1]
    product = weights
    for _ in range(dim - 1):
        product = np.multiply.outer(weights, product)
    return product.ravel()
