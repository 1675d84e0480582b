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
    """The L2 error over the whole surface halves with the cells: first order, as the edge of contact allows."""
    errors = [found.pressure_error for found in solutions]
    orders = -np.diff(np.log2(errors))
    assert errors[-1] < 0.04, errors
    assert orders.mean() > 0.9, errors


def test_the_top_carries_the_force(solutions):
    """Force balance: what contact gives, the support at the top takes; no force along the plane."""
    for found in solutions:
        structure, contact = found.structure, found.contact
        points = structure.bodies[0].points[:, : structure.bodies[0].owned]
        top = points[2] > hertz.BLOCK - 1e-9
        reaction = structure.residual_force.reshape(-1, 3)[top, 2].sum()
        assert 4 * reaction == pytest.approx(-found.force, rel=1e-10)
        assert np.abs(contact.resultant(0)[:2]).max() < 1e-10 * found.force


def test_newton_is_short(solutions):
    """A load step from no contact at all; other programs need 4 to 10 steps for it."""
    assert max(found.newton for found in solutions) <= 6
