"""Rounding error of a residual, from the sizes of the terms that it is the sum of."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from petsc4py import PETSc

from solvers.api import Array


def rounding_error(matrix: PETSc.Mat, values: Array) -> Array:
    """Rounding error by rows of the sums A x, shape (owned rows,), for owned values x (collective).

    Every product a_ij x_j is wrong by about eps |a_ij x_j| with a random sign, so that row i is wrong by about
    eps (sum_j (a_ij x_j)^2)^(1/2). Row i of A times x with random signs has this size. The signs are always the same.
    """
    x, y = matrix.createVecs()
    x.array[:] = _signs(matrix.comm.rank, len(values)) * values
    matrix.mult(x, y)
    return float(np.finfo(float).eps) * np.abs(y.array)


@lru_cache(maxsize=8)
def _signs(rank: int, n: int) -> Array:
    return np.random.default_rng(rank).choice((-1.0, 1.0), n)
