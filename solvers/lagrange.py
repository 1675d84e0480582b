"""Lagrange polynomials in one dimension."""

from __future__ import annotations

import numpy as np

from solvers.api import Array


def lagrange(points: Array, x: Array) -> Array:
    """Lagrange polynomials on some points, evaluated at x, along one more axis."""
    return np.stack([np.prod([(x - p) / (q - p) for p in points if p != q], axis=0) for q in points], axis=-1)
