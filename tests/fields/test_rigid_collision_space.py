"""Two free rigid bodies collide obliquely in space, with friction: momentum, spins, Newton's and Coulomb's laws."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Tolerance
from solvers.rigid import motion
from solvers.rigid.body import RigidBody
from solvers.rigid.contact import RigidContact, RigidPair
from solvers.rigid.field import RigidBodies
from solvers.rigid.inertia import inertia_of_surface

CORNERS = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]) - 0.5
SIDES = np.array(
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
     [1, 3, 5], [3, 7, 5]]
)  # fmt: skip
#: An octahedron whose corner on the left meets the right side of the box, out of its middle.
EIGHT = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]]) * 0.4
FACES = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])


def turned(points: np.ndarray) -> np.ndarray:
    """By 0.3 about z and 0.2 about y, about the origin."""
    c, s, d, r = np.cos(0.3), np.sin(0.3), np.cos(0.2), np.sin(0.2)
    return points @ (np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[d, 0, r], [0, 1, 0], [-r, 0, d]])).T


def two(scale: float) -> tuple[RigidBody, RigidBody]:
    at = scale * np.array([1.0, 0.13, -0.21]) * [0.905, 1.0, 1.0]
    box, eight = turned(scale * CORNERS), turned(scale * EIGHT + at)
    velocity, spin = turned(scale * np.array([[1.5, 0.2, 0.0], [-1.0, 0.4, 0.7]])), (0.3, -0.2, 0.5)
    return (
        RigidBody("box", box, SIDES, inertia_of_surface(box, SIDES, 2.0), initial_velocity=velocity[0]),
        RigidBody(
            "eight",
            eight,
            FACES,
            inertia_of_surface(eight, FACES, 3.0),
            initial_velocity=velocity[1],
            initial_spin=spin,
        ),
    )


def of_centre(body: RigidBody, now) -> np.ndarray:
    return body.inertia.centre + now.shift


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
@pytest.mark.parametrize(("friction", "scale"), [(0.02, 1.0), (0.02, 1e-3), (5.0, 1.0), (5.0, 1e-3)])
def test_an_oblique_collision_in_space(order, restitution, friction, scale):
    """Each body gains the impulse and its moment about the own centre, at the end of the step in which they meet."""
    chosen = [two(scale)[k] for k in order]
    contact = RigidContact(chosen, [RigidPair(0, 1, friction)], restitution=restitution)
    bodies = RigidBodies(chosen, GeneralisedAlpha.from_rho_inf(1.0), Tolerance(1e-12), contact=contact)
    bodies.initialise(0.0, 0.005)
    for n in range(20):
        was = list(bodies.now)
        bodies.step(0.005 * n, 0.005)
        if bodies.in_contact():
            break
    assert bodies.in_contact()
    old, new = (
        [motion.momentum(body, now.R, now.v) for body, now in zip(chosen, instants, strict=True)]
        for instants in (was, bodies.now)
    )
    size = np.abs(old[0][:3]).max()
    impulse = new[0][:3] - old[0][:3]
    assert np.linalg.norm(impulse) > 0.1 * size
    assert new[1][:3] - old[1][:3] == pytest.approx(-impulse, abs=1e-10 * size)
    tip = order.index(1)
    arm = bodies.now[tip].R @ (chosen[tip].points[1] - chosen[tip].inertia.centre)
    corner = of_centre(chosen[tip], bodies.now[tip]) + arm
    relative = []
    for instants in (was, bodies.now):
        v = []
        for body, at, now in zip(chosen, bodies.now, instants, strict=True):
            v.append(now.v[:3] + np.cross(motion.spin(now), corner - of_centre(body, at)))
        relative.append(v[0] - v[1])
    for body, now, before, after, sign in zip(chosen, bodies.now, old, new, (1.0, -1.0), strict=True):
        moment = np.cross(corner - of_centre(body, now), sign * impulse)
        assert after[3:] - before[3:] == pytest.approx(moment, abs=1e-10 * size * scale)
    side = order.index(0)
    normal = bodies.now[side].R @ turned(np.array([[1.0, 0.0, 0.0]]))[0]
    assert relative[1] @ normal == pytest.approx(-restitution * (relative[0] @ normal), abs=1e-9 * scale)
    slides, along = (part - (part @ normal) * normal for part in (relative[1], impulse))
    if friction > 1.0:
        assert slides == pytest.approx(np.zeros(3), abs=1e-9 * scale)
    else:
        pressed = friction * abs(impulse @ normal)
        assert along == pytest.approx(-pressed * slides / np.linalg.norm(slides), abs=1e-8 * pressed)
