"""The predictor of free rigid bodies: it keeps their velocity and leaves what they would enter."""

from __future__ import annotations

import numpy as np
import pytest
from fluid_setup import loop

from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Tolerance
from solvers.rigid import predicted
from solvers.rigid.body import RigidBody
from solvers.rigid.contact import RigidContact, RigidPair
from solvers.rigid.field import RigidBodies
from solvers.rigid.gaps import RigidWall
from solvers.rigid.inertia import inertia_of_surface

GROUND = RigidWall("ground", np.zeros(2), np.array([0.0, 1.0]))
GROUND_3D = RigidWall("ground", np.zeros(3), np.array([0.0, 0.0, 1.0]))
STEP = 0.01
CUBE_FACETS = np.array(
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
     [1, 3, 5], [3, 7, 5]]
)  # fmt: skip


def box_above(height, velocity, scale=1.0, held=()):
    """A square or cube of side `scale` at a height above the ground, in 2D or 3D by its velocity."""
    dim = len(velocity)
    if dim == 2:
        points, facets = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), loop(4)
    else:
        points = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
        facets = CUBE_FACETS
    points = scale * points
    points[:, -1] += height
    inertia = inertia_of_surface(points, facets, 3.0)
    return RigidBody("box", points, facets, inertia, held=dict.fromkeys(held, lambda t: 0.0), initial_velocity=velocity)


def field_of(bodies, pairs, rho_inf=1.0):
    scheme = GeneralisedAlpha.from_rho_inf(rho_inf)
    return RigidBodies(bodies, scheme, Tolerance(1e-10), contact=RigidContact(bodies, pairs))


@pytest.mark.parametrize("scale", [1.0, 1e-3])
@pytest.mark.parametrize("velocity", [(3.0, -2.0), (3.0, 1.0, -2.0)])
def test_it_stops_at_the_ground(velocity, scale):
    """A box that falls flat keeps its velocity along the ground, and ends on it; a step before it is not changed."""
    ground = GROUND if len(velocity) == 2 else GROUND_3D
    velocity = scale * np.array(velocity)
    body = box_above(0.013 * scale, velocity, scale)
    bodies = field_of([body], [RigidPair(0, ground)])
    bodies.initialise(0.0, STEP)
    bodies.begin_step(0.0, 0.5 * STEP)
    bodies.predict(0.5 * STEP)
    free = np.zeros(6)
    free[: len(velocity)] = 0.5 * STEP * velocity
    assert bodies.increments()[0] == pytest.approx(free, abs=1e-15 * scale)
    bodies.begin_step(0.5 * STEP, STEP)
    bodies.predict(1.5 * STEP)
    stopped = 2.0 * free
    stopped[len(velocity) - 1] = -0.003 * scale
    assert bodies.increments()[0] == pytest.approx(stopped, abs=1e-9 * scale)
    bodies.retreat(np.ones(len(bodies.bodies)))
    assert bodies.increments()[0] == pytest.approx(np.zeros(6), abs=1e-15 * scale)


def two_that_meet(dim):
    """Two boxes on the same way, whose corners meet, in the plane or in space."""
    one = box_above(0.0, [4.0, 0.5] if dim == 2 else [4.0, 0.3, 0.5])
    turned = box_above(0.0, [-2.0, 0.0] if dim == 2 else [-2.0, 0.0, 0.0])
    c, s = np.cos(0.6), np.sin(0.6)
    R = np.eye(dim)
    R[:2, :2] = [[c, -s], [s, c]]
    points = turned.points @ R.T + np.array([2.2, 0.1] if dim == 2 else [2.2, 0.1, 0.2])
    inertia = inertia_of_surface(points, turned.facets, 3.0)
    other = RigidBody("other", points, turned.facets, inertia, initial_velocity=turned.initial_velocity)
    return field_of([one, other], [RigidPair(0, 1, 0.3)])


@pytest.mark.parametrize("dim", [2, 3])
def test_the_motion_does_not_depend_on_it(dim, monkeypatch):
    """Without it, with one iterate and with many; momentum is kept."""
    ends = []
    for count in (0, 1, predicted.PREDICTIONS, 30):
        monkeypatch.setattr(predicted, "PREDICTIONS", count)
        bodies = two_that_meet(dim)
        bodies.initialise(0.0, STEP)
        touched = False
        for n in range(30):
            bodies.begin_step(STEP * n, STEP)
            bodies.predict(STEP * (n + 1))
            bodies.solve()
            bodies.end_step()
            touched |= bodies.in_contact()
        assert touched
        ends.append(np.concatenate([np.concatenate([now.shift, now.v]) for now in bodies.now]))
        momentum = sum(body.inertia.mass * now.v[:dim] for body, now in zip(bodies.bodies, bodies.now, strict=True))
        before = sum(body.inertia.mass * np.array(body.initial_velocity) for body in bodies.bodies)
        assert momentum == pytest.approx(before, rel=1e-8, abs=1e-8)
    for end in ends[1:]:
        assert end == pytest.approx(ends[0], abs=1e-8)
