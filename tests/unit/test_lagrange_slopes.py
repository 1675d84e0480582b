"""Derivatives of Lagrange polynomials."""

import numpy as np
import pytest

from solvers.mesh.gauss import gauss
from solvers.mesh.lagrange import lagrange, lagrange_slopes


@pytest.mark.parametrize("count", [2, 3, 5])
def test_slopes_by_finite_differences(count):
    points, step = gauss(count)[0], 1e-6
    differences = (lagrange(points, points + step) - lagrange(points, points - step)) / (2.0 * step)
    assert np.abs(lagrange_slopes(points) - differences).max() < 1e-8
