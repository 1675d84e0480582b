"""Whether the tangent of rigid bodies is positive definite, by its pivots, and piles that need to know."""

from dataclasses import replace

import numpy as np
import pytest

from solvers.algebra.sparse import sparse_from_entries
from solvers.march import march
from solvers.rigid.body import RigidBody
from solvers.rigid.contact import RigidContact, RigidPair
from solvers.rigid.coulomb import Touch, braced, positive_definite
from solvers.rigid.field import RigidBodies
from solvers.rigid.gaps import RigidWall
from solvers.rigid.inertia import inertia_of_surface


def test_pivots_tell_as_eigenvalues_do():
    """Random sparse matrices with a small skew part, of which about half are definite."""
    rng = np.random.default_rng(0)
    found = []
    for _ in range(100):
        A = rng.standard_normal((30, 30)) * (rng.random((30, 30)) < 0.1)
        A = A + A.T + rng.uniform(0.0, 8.0) * np.eye(30)
        B = A + 0.1 * (np.triu(A, 1) - np.tril(A, -1))
        rows, columns = np.nonzero(B)
        found.append(positive_definite(sparse_from_entries(rows, columns, B[rows, columns], B.shape)))
        assert found[-1] == (np.linalg.eigvalsh(A).min() > 0.0)
    assert 20 < sum(found) < 80


def test_contacts_brace_what_they_leave_no_motion_for():
    """Two bodies, two contacts: as the eigenvalues in the motions that closed and stuck contacts leave."""
    rng = np.random.default_rng(4)
    found = []
    for _ in range(60):
        A = rng.standard_normal((6, 6))
        K = A + A.T + 0.5 * np.eye(6)
        K[3:, :3] = K[:3, 3:] = 0.1 * K[:3, 3:]
        K[np.arange(6), np.arange(6)] += 1.0
        touch = Touch(rng.standard_normal((2, 2, 2, 3)), np.array([[0, 1], [1, -1]]), np.array([0.5, 0.5]))
        touch.B[1, 1] = 0.0
        z = np.array([[1.0, 0.2], [1.0, -0.5]])  # one sticks, one slides
        rows, columns = np.nonzero(K)
        sparse = sparse_from_entries(rows, columns, K[rows, columns], K.shape)
        kept = touch.rows(6).toarray()[:3]
        left = np.linalg.svd(kept)[2][3:].T
        least = np.linalg.eigvalsh(left.T @ K @ left).min()
        if abs(least) > 0.1:  # the penalty is finite
            found.append(braced(sparse, touch, z))
            assert found[-1] == (least > 0.0)
    assert 0.2 * len(found) < sum(found) < 0.9 * len(found)


def disc(number, centre, radius=0.045, sides=16):
    angle = 2.0 * np.pi * np.arange(sides) / sides
    points = centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    facets = np.stack([np.arange(sides), (np.arange(sides) + 1) % sides], axis=1)
    inertia = inertia_of_surface(points, facets, 20.0)
    return RigidBody(f"d{number}", points, facets, inertia, gravity=(0.0, -10.0))


def test_eight_discs_settle_in_a_shaft():
    """Contact overturns single discs, but others hold them: Newton's method has the whole tangent there."""
    rng, bodies = np.random.default_rng(1), []
    for k in range(8):
        place = np.array([0.1 + 0.19 * (k % 2) + 0.02 * ((k // 2) % 2), 0.06 + 0.115 * (k // 2)])
        bodies.append(disc(k, place + 0.01 * rng.uniform(-1, 1, 2)))
    walls = [
        RigidWall(name, np.array(at), np.array(normal))
        for name, at, normal in (
            ("floor", (0.0, 0.0), (0.0, 1.0)),
            ("left", (0.0, 0.0), (1.0, 0.0)),
            ("right", (0.38, 0.0), (-1.0, 0.0)),
        )
    ]
    pairs = [RigidPair(i, wall, 0.3) for i in range(8) for wall in walls]
    pairs += [RigidPair(i, j, 0.3) for i in range(8) for j in range(i)]
    field = RigidBodies(bodies, contact=RigidContact(bodies, pairs))
    taken = [info.iterations for _, info in march(field, 0.3, 30)]
    assert max(taken) <= 12
    assert field.contact.active.sum() >= 4


def pressed_disc(squeeze):
    """A disc with friction on a floor, pressed from all sides by a flow; field after a residual, like an iterate."""
    body = replace(disc(0, np.array([0.0, 0.0449])), gravity=(1.0, -10.0, 0.0))
    floor = RigidWall("floor", np.array([0.0, 0.0]), np.array([0.0, 1.0]))
    field = RigidBodies([body], contact=RigidContact([body], [RigidPair(0, floor, 0.3)]))
    field.initialise(0.0, 0.01)
    field.begin_step(0.0, 0.01)
    field.set_increments(np.array([[0.0, -1e-3, 0.0, 0.0, 0.0, 0.0]]))
    arms = body.points - np.array([0.0, 0.0449])
    field.load(-squeeze * arms / np.linalg.norm(arms, axis=1)[:, None])
    field.residual()
    return field


def test_a_flow_that_would_overturn_a_body_leaves_its_contact():
    """Pressure all around has no resultant, but turns: from 7 N per vertex on it overturns; contact is the same."""
    alone, pressed = pressed_disc(0.0), pressed_disc(1e3)
    assert not positive_definite(pressed._system())
    assert positive_definite(pressed._upright())
    assert pressed.contact.active.any()
    assert pressed.contact.z == pytest.approx(alone.contact.z, rel=1e-9)
