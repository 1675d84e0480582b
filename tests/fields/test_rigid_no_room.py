"""What misses its room by rounding has room; what misses more has none."""

import numpy as np
import pytest

from solvers.algebra.sparse import sparse_from_entries
from solvers.api import FailureKind, StepFailed
from solvers.rigid.coulomb import Touch, contact_forces

#: A body of stiffness 1 between two walls; its left side and its right side touch them.
STIFFNESS = sparse_from_entries(np.arange(3), np.arange(3), np.ones(3), (3, 3))
SIDES = Touch(
    np.array([[[[1.0, 0, 0], [0, 1, 0]], np.zeros((2, 3))], [[[-1.0, 0, 0], [0, 1, 0]], np.zeros((2, 3))]]),
    np.array([[0, -1], [0, -1]]),
    np.array([0.3, 0.3]),
)
WEIGHT = np.array([0.0, -1.0, 0.0])


def squeezed(missing):
    return contact_forces(STIFFNESS, WEIGHT, SIDES, np.array([[-missing, 0.0], [-missing, 0.0]]))


@pytest.mark.parametrize("missing", [0.0, 1e-14, 1e-10, 1e-9, 1e-8])
def test_a_pile_that_misses_its_room_by_rounding(missing):
    """Walls that are nearer than the width by 1e-8 of the way by the forces (1): friction holds the body."""
    u, z, _ = squeezed(missing)
    assert STIFFNESS @ u - WEIGHT == pytest.approx(SIDES.force(z, 3), abs=1e-12)
    assert np.abs(SIDES.motion(u)[:, 0] - missing).max() <= 2.0 * missing + 1e-15
    assert (np.abs(z[:, 1]) <= 0.3 * z[:, 0] * (1.0 + 1e-12)).all()


@pytest.mark.parametrize("missing", [1e-6, 1e-3, 1.0])
def test_walls_that_are_too_near(missing):
    with pytest.raises(StepFailed, match="bodies in contact have no room") as failed:
        squeezed(missing)
    assert failed.value.kind == FailureKind.NO_ROOM


def falling_beside_a_wall(angle):
    """Two discs that touch each other, and a wall that one of them touches; forces of a step before are still known."""
    masses = np.array([3.0, 3.0, 0.0155, 2.0, 2.0, 0.0063])
    n, t = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    B = np.zeros((2, 2, 2, 3))
    B[0, 0], B[0, 1] = [[*n, 0.001], [*t, -0.08]], [[*-n, -0.0035], [*-t, -0.0995]]
    B[1, 0] = [[-1.0, 0.0, 0.007], [0.0, -1.0, -0.0997]]
    touch = Touch(B, np.array([[1, 0], [0, -1]]), np.array([0.3, 0.3]))
    K = sparse_from_entries(np.arange(6), np.arange(6), masses, (6, 6))
    weight = np.array([0.0, -10.0 * masses[0], 0.0, 0.0, -10.0 * masses[3], 0.0])
    return contact_forces(K, weight, touch, np.zeros((2, 2)), np.array([[20.0, 1.0], [8.0, -2.4]]))


def test_contacts_that_carry_nothing():
    """Bodies that touch and fall side by side: no forces, whatever these were before."""
    for angle in 0.3 + 0.011 * np.arange(121):
        u, z, _ = falling_beside_a_wall(angle)
        assert np.abs(z).max() <= 1e-8
        assert u == pytest.approx([0, -10, 0, 0, -10, 0], abs=1e-8)
