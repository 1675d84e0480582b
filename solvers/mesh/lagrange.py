"""Lagrange polynomials in one dimension."""

from __future__ import annotations

import math

import numpy as np

from solvers.api import Array


def lagrange(points: Array, x: Array) -> Array:
    """Lagrange polynomials on some points, evaluated at x, along one more axis."""
    factors = [[(x - p) / (q - p) for p in points if p != q] for q in points]
    return np.stack([math.prod(some, start=1.0) for some in factors], axis=-1)  # three times as fast as np.prod
