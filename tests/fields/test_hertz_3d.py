"""Hertz in 3D (a quarter of a ball between planes of symmetry, see fsci.bench.hertz) against the exact pressure."""

import numpy as np
import pytest

from fsci.bench import hertz

#: Cells per radius of contact, and cells outside.
MESHES = [(2, 4), (4, 4), (8, 5)]


@pytest.fixture(scope="module")
def solutions():
    return [hertz.solve(*mesh) for mesh in MESHES]


def test_the_ball_touches_as_planned(solutions):
    for found in solutions:
        assert found.radius == pytest.approx(1.0, rel=0.02)


def test_peak(solutions):
    finest = solutions[-1]
    assert finest.radius / (hertz.CORE / round(8 * hertz.CORE)) >= 7.9  # cells per radius
    assert abs(finest.peak_error) < 0.02


def test_pressure_converges(solutions):
    """In L2 over all of it, and the slope at the edge of contact is infinite: order 1/2 to 1 (Wohlmuth 2011)."""
    errors = [found.pressure_error for found in solutions]
    orders = -np.diff(np.log2(errors))
    assert errors[-1] < 0.05, errors
    assert orders.min() > 0.5, errors


def test_pressure_inside(solutions):
    """Off the edge, within 0.8 radii, the finest mesh has every nodal pressure to 3 %."""
    finest = solutions[-1]
    inside = finest.distance < 0.8 * finest.radius
    exact = finest.peak * np.sqrt(1.0 - (finest.distance[inside] / finest.radius) ** 2)
    assert inside.sum() > 30
    assert np.abs(finest.pressure[inside] / exact - 1.0).max() < 0.03


def test_the_top_carries_the_force(solutions):
    """Force balance: what contact gives, the support at the top takes, up to Newton's tolerance."""
    for found in solutions:
        structure = found.structure
        points = structure.bodies[0].points[:, : structure.bodies[0].owned]
        top = points[2] > hertz.BLOCK - 1e-9
        along = structure.residual_force.reshape(-1, 3)[:, 2]
        assert 4 * along[top].sum() == pytest.approx(-found.force, rel=1e-9)
        assert 4 * along.sum() == pytest.approx(-found.force, rel=1e-12)


def test_newton_is_short(solutions):
    """A load step from no contact at all; other programs need 4 to 10 steps for it."""
    assert max(found.newton for found in solutions) <= 6
