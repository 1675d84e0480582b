"""Contact of rigid bodies with each other, with walls and with obstacles that move, without a flow."""

from __future__ import annotations

import numpy as np
import pytest
from advised import require_advice
from fluid_setup import loop

from solvers.api import FailureKind, StepFailed
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.march import march
from solvers.newton import Tolerance
from solvers.rigid import motion
from solvers.rigid.body import RigidBody
from solvers.rigid.contact import Obstacle, RigidContact, RigidPair
from solvers.rigid.field import RigidBodies
from solvers.rigid.gaps import RigidWall, gaps
from solvers.rigid.inertia import inertia_of_surface

FLOOR = RigidWall("floor", np.array([0.0, 0.0]), np.array([0.0, 1.0]))
SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


def polygon(name: str, points, density: float = 3.0, **settings) -> RigidBody:
    facets = loop(len(points))
    return RigidBody(name, points, facets, inertia_of_surface(points, facets, density), **settings)


def disc(name: str, centre, radius: float = 0.5, n: int = 24, turned: float = 0.0, **settings) -> RigidBody:
    angles = turned + 2.0 * np.pi * np.arange(n) / n
    return polygon(name, np.array(centre) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1), **settings)


def field(bodies, pairs, rho_inf: float = 1.0, restitution: float = 0.0) -> RigidBodies:
    contact = RigidContact(bodies, pairs, restitution=restitution)
    return RigidBodies(bodies, GeneralisedAlpha.from_rho_inf(rho_inf), Tolerance(1e-12), contact=contact)


def momenta(bodies: RigidBodies) -> np.ndarray:
    """Momentum and angular momentum about the origin, shape (6,)."""
    total = np.zeros(6)
    for body, now in zip(bodies.bodies, bodies.now, strict=True):
        own = motion.momentum(body, now.R, now.v)
        centre = np.pad(body.inertia.centre, (0, 1)) + now.shift
        total += np.concatenate([own[:3], own[3:] + np.cross(centre, own[:3])])
    return total


def kinetic(bodies: RigidBodies) -> float:
    return sum(motion.kinetic_energy(body, now) for body, now in zip(bodies.bodies, bodies.now, strict=True))


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_collision_keeps_momentum(restitution):
    """Two discs of different mass collide out of their centres; with restitution 1 no energy is lost."""
    one = disc("one", (0.0, 0.0), turned=0.1, initial_velocity=(2.0, 0.1), initial_spin=(0.0, 0.0, 0.7))
    two = disc("two", (1.3, 0.3), turned=0.2, density=1.0, initial_velocity=(-1.0, 0.0))
    bodies = field([one, two], [RigidPair(0, 1)], restitution=restitution)
    bodies.initialise(0.0, 0.01)
    before, energy = momenta(bodies), kinetic(bodies)
    touched = 0
    for n in range(30):
        bodies.step(0.01 * n, 0.01)
        touched += bodies.in_contact()
        x = [body.points + d for body, d in zip(bodies.bodies, np.split(bodies.displacement(), 2), strict=True)]
        assert gaps(x[0], x[1][two.facets]).gap.min() > -1e-9
    assert touched
    # the force acts at the vertex at the end of the step: its arm moves by the way of one step
    np.testing.assert_allclose(momenta(bodies)[:2], before[:2], rtol=1e-10)
    assert kinetic(bodies) <= energy * (1.0 + 1e-10)
    if restitution == 1.0:
        assert kinetic(bodies) == pytest.approx(energy, rel=1e-9)
    else:
        assert kinetic(bodies) < 0.95 * energy


def test_a_stack_stands_on_a_wall():
    """Each square carries what is above it; the squares lie on each other with all of their sides."""
    names = "abc"
    stack = [polygon(n, SQUARE + np.array([0.0, 0.5 + 1.05 * k]), gravity=(0.0, -10.0)) for k, n in enumerate(names)]
    bodies = field(stack, [RigidPair(0, FLOOR), RigidPair(0, 1), RigidPair(1, 2), RigidPair(0, 2)], rho_inf=0.5)
    for _ in march(bodies, 1.0, 50):
        pass
    heights = [now.shift[1] for now in bodies.now]
    assert heights == pytest.approx([0.0, -0.05, -0.1], abs=1e-9)
    assert bodies.contact.force[1::3] == pytest.approx([30.0, 30.0, 30.0], rel=1e-8)  # each is held up by its weight
    floor = [now.p[1] for now in bodies.now]
    assert floor == pytest.approx([0.0, 0.0, 0.0], abs=1e-8)
    on_floor = bodies.contact.near.body[:, 1] < 0
    assert bodies.contact.z[on_floor, 0].sum() == pytest.approx(90.0, rel=1e-8)


@pytest.mark.slow
def test_the_order_of_bodies_does_not_matter():
    """Four discs fall on each other in a corner."""
    walls = [FLOOR, RigidWall("side", np.array([-1.0, 0.0]), np.array([1.0, 0.0]))]
    discs = [disc(f"d{k}", (-0.3 + 0.17 * k, 0.7 + 1.1 * k), turned=0.3 * k, gravity=(-1.0, -10.0)) for k in range(4)]

    def ends(order) -> dict[str, np.ndarray]:
        chosen = [discs[k] for k in order]
        pairs = [RigidPair(a, b) for b in range(4) for a in range(b)] + [
            RigidPair(a, w) for a in range(4) for w in walls
        ]
        bodies = field(chosen, pairs, rho_inf=0.5)
        for _ in march(bodies, 0.6, 60):
            pass
        return {body.name: now.shift for body, now in zip(chosen, bodies.now, strict=True)}

    one, other = ends([0, 1, 2, 3]), ends([2, 0, 3, 1])
    for name, shift in one.items():
        np.testing.assert_allclose(other[name], shift, atol=1e-7)
    assert one["d3"][1] < -0.5


def test_the_force_on_what_is_held_is_that_of_contact():
    """A block lies on a table that cannot move."""
    table = polygon("table", SQUARE * [4.0, 1.0], held=dict.fromkeys(("x", "y", "rotation_z"), lambda t: 0.0))
    block = polygon("block", SQUARE + np.array([0.0, 1.0]), gravity=(0.0, -10.0))
    bodies = field([table, block], [RigidPair(1, 0)], rho_inf=0.5)
    for _ in march(bodies, 0.3, 15):
        pass
    found = bodies.numbers()
    weight = 10.0 * block.inertia.mass
    assert found["contact.on_block.y"] == pytest.approx(weight, rel=1e-8)
    assert found["contact.on_table.y"] == pytest.approx(-weight, rel=1e-8)


def test_a_wall_ends_where_its_patch_does():
    part = RigidWall("part", np.zeros(2), np.array([0.0, 1.0]), lambda x: x[0] > 0.0)
    found = part.gaps(np.array([[0.5, -0.1], [-0.5, -0.1], [0.5, 2.0]]))
    assert found.gap.tolist() == [-0.1, np.inf, 2.0]


def test_a_corner_of_an_obstacle_meets_a_side():
    """The tip of a wedge is a vertex of the obstacle: the body has none near it."""
    wedge = Obstacle("wedge", np.array([[0.0, 0.0], [-1.0, -1.0], [1.0, -1.0]]), loop(3))
    body = polygon("block", SQUARE * [2.0, 1.0] + [0.0, 0.7], gravity=(0.0, -10.0), held={"rotation_z": lambda t: 0.0})
    bodies = field([body], [RigidPair(0, wedge)], rho_inf=0.5)
    for _ in march(bodies, 1.0, 50):
        pass
    assert bodies.now[0].shift[1] == pytest.approx(-0.2, abs=1e-9)
    assert bodies.contact.force[1] == pytest.approx(60.0, rel=1e-9)


def test_a_rising_table_lifts_a_body():
    """The body has the velocity of the table, and falls back on it when that stops."""
    plate = np.array([[2.0, 0.0], [-2.0, 0.0]])
    table = Obstacle("table", plate, np.array([[0, 1]]), motion=lambda t: plate + np.array([0.0, 0.5 * t]))
    body = polygon("block", SQUARE + np.array([0.0, 0.5]), gravity=(0.0, -10.0))
    bodies = field([body], [RigidPair(0, table)], rho_inf=0.5)
    for t, _ in march(bodies, 0.5, 25):
        assert bodies.now[0].shift[1] == pytest.approx(0.5 * t, abs=1e-9)
    assert bodies.now[0].v[1] == pytest.approx(0.5, abs=1e-9)
    assert bodies.contact.force[1] == pytest.approx(30.0, rel=1e-6)


def test_bodies_without_room_say_so():
    """A table rises against a block that is held."""
    plate = np.array([[2.0, 0.0], [-2.0, 0.0]])
    table = Obstacle("table", plate, np.array([[0, 1]]), motion=lambda t: plate + np.array([0.0, 0.5 * t]))
    held = {name: lambda t: 0.0 for name in ("x", "y", "rotation_z")}
    body = polygon("block", SQUARE + np.array([0.0, 0.5]), held=held)
    bodies = field([body], [RigidPair(0, table)])
    bodies.initialise(0.0, 0.1)
    with pytest.raises(StepFailed, match="bodies in contact have no room") as failed:
        bodies.step(0.0, 0.1)
    require_advice(failed.value, FailureKind.NO_ROOM)


def test_a_ball_on_a_ball_in_space():
    """An octahedron falls with a corner on the middle of a face of a cube."""
    cube = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
    sides = np.array(
        [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
         [1, 3, 5], [3, 7, 5]]
    )  # fmt: skip
    eight = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]]) * 0.4 + [0.45, 0.52, 1.6]
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    floor = RigidWall("floor", np.zeros(3), np.array([0.0, 0.0, 1.0]))
    turns = {f"rotation_{axis}": lambda t: 0.0 for axis in "xyz"}
    below = RigidBody("cube", cube, sides, inertia_of_surface(cube, sides, 2.0), gravity=(0, 0, -10.0))
    above = RigidBody("eight", eight, faces, inertia_of_surface(eight, faces, 2.0), gravity=(0, 0, -10.0), held=turns)
    bodies = field([below, above], [RigidPair(0, 1), RigidPair(0, floor), RigidPair(1, floor)], rho_inf=0.5)
    for _ in march(bodies, 0.6, 30):
        pass
    assert bodies.now[1].shift[2] == pytest.approx(-0.2, abs=1e-9)
    assert bodies.now[0].shift == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
