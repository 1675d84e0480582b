"""Estimate of the rounding error of a residual, from the magnitudes of the terms of its sum."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from petsc4py import PETSc

from solvers.api import Array


def rounding_error(matrix: PETSc.Mat, values: Array) -> Array:
    """Rounding error of the sums A x by rows, shape (owned rows,), for owned values x (collective).

    The product a_ij x_j has an error of about eps |a_ij x_j| with a random sign, so that the error of row i is about
    eps (sum_j (a_ij x_j)^2)^(1/2). Row i of A times x with random signs has this magnitude. The random signs are the
    same in every call.
    """
    x, y = matrix.createVecs()
    x.array[:] = random_signs(matrix.comm.rank, len(values)) * values
    matrix.mult(x, y)
    return float(np.finfo(float).eps) * np.abs(y.array)


@lru_cache(maxsize=8)
def random_signs(rank: int, n: int) -> Array:
    """The n signs of a process, the same in every call."""
    return np.random.default_rng(rank).choice((-1.0, 1.0), n)
