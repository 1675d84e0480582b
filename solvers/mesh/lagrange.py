"""Lagrange polynomials in one dimension."""

from __future__ import annotations

import math

import numpy as np

from solvers.api import Array


def lagrange(points: Array, x: Array) -> Array:
    """Lagrange polynomials on some points, evaluated at x, along one more axis."""
    factors = [[(x - p) / (q - p) for p in points if p != q] for q in points]
    return np.stack([math.prod(some, start=1.0) for some in factors], axis=-1)  # three times as fast as np.prod


def lagrange_slopes(points: Array) -> Array:
    """Derivatives of Lagrange polynomials at their points, shape (points, polynomials)."""
    apart = points[:, None] - points
    np.fill_diagonal(apart, 1.0)
    weight = 1.0 / apart.prod(axis=1)
    found = weight / weight[:, None] / apart
    np.fill_diagonal(found, (1.0 / apart).sum(axis=1) - 1.0)
    return found
