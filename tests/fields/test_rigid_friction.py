"""Friction of rigid bodies with each other and with walls, without a flow: rolling, sliding, tipping, impacts."""

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
from solvers.rigid.gaps import RigidWall
from solvers.rigid.inertia import inertia_of_surface
from solvers.rigid.near import search

GRAVITY = 10.0
FLOOR = RigidWall("floor", np.zeros(2), np.array([0.0, 1.0]))
FLOOR_3D = RigidWall("floor", np.zeros(3), np.array([0.0, 0.0, 1.0]))
SQUARE = np.array([[-0.5, 0.0], [0.5, 0.0], [0.5, 1.0], [-0.5, 1.0]])


def polygon(name: str, points, density: float = 3.0, **settings) -> RigidBody:
    facets = loop(len(points))
    return RigidBody(name, points, facets, inertia_of_surface(points, facets, density), **settings)


def disc(name: str, centre, radius: float = 0.5, n: int = 24, turned: float = 0.0, **settings) -> RigidBody:
    angles = turned + 2.0 * np.pi * np.arange(n) / n
    return polygon(name, np.array(centre) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1), **settings)


def brick(name: str, low, high, **settings) -> RigidBody:
    corners = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
    points = np.array(low) + corners * (np.array(high) - np.array(low))
    sides = np.array(
        [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
         [1, 3, 5], [3, 7, 5]]
    )  # fmt: skip
    return RigidBody(name, points, sides, inertia_of_surface(points, sides, 3.0), **settings)


def ball(name: str, centre, radius: float = 0.5, n: int = 16, rings: int = 11, **settings) -> RigidBody:
    """Rings of latitude about x: it rolls along y over the vertices of its largest ring."""
    rows = [[radius, 0.0, 0.0]]
    for latitude in np.linspace(0.0, np.pi, rings + 2)[1:-1]:
        for angle in 2.0 * np.pi * np.arange(n) / n:
            ring = np.sin(latitude)
            rows.append([radius * np.cos(latitude), radius * ring * np.cos(angle), radius * ring * np.sin(angle)])
    rows.append([-radius, 0.0, 0.0])
    points = np.array(centre) + np.array(rows)
    facets = []
    for k in range(n):
        after = (k + 1) % n
        facets.append([0, 1 + k, 1 + after])
        facets.append([len(rows) - 1, 1 + (rings - 1) * n + after, 1 + (rings - 1) * n + k])
        for ring in range(rings - 1):
            a, b = 1 + ring * n, 1 + (ring + 1) * n
            facets += [[a + k, b + k, a + after], [a + after, b + k, b + after]]
    facets = np.array(facets)
    return RigidBody(name, points, facets, inertia_of_surface(points, facets, 3.0), **settings)


def field(bodies, pairs, rho_inf: float = 0.5, restitution: float = 0.0) -> RigidBodies:
    contact = RigidContact(bodies, pairs, restitution=restitution)
    return RigidBodies(bodies, GeneralisedAlpha.from_rho_inf(rho_inf), Tolerance(1e-11), contact=contact)


def slope(angle: float, dim: int = 2) -> tuple[float, ...]:
    """Gravity on a slope that falls along the first axis; the frame turns with it."""
    along, down = GRAVITY * np.sin(angle), -GRAVITY * np.cos(angle)
    return (along, down) if dim == 2 else (0.0, along, down)


def momenta(bodies: RigidBodies) -> np.ndarray:
    """Momentum and angular momentum about the origin, shape (6,)."""
    total = np.zeros(6)
    for body, now in zip(bodies.bodies, bodies.now, strict=True):
        own = motion.momentum(body, now.R, now.v)
        centre = np.pad(body.inertia.centre, (0, 3 - body.dim)) + now.shift
        total += np.concatenate([own[:3], own[3:] + np.cross(centre, own[:3])])
    return total


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(("angle", "a"), [(0.2, 0.0), (0.4, GRAVITY * (np.sin(0.4) - 0.3 * np.cos(0.4)))])
def test_a_block_on_a_slope_rests_or_slides(dim, angle, a):
    """It stays if tan(angle) is below the friction 0.3, else it slides with g (sin a - mu cos a)."""
    gravity = slope(angle, dim)
    if dim == 2:
        body, wall = polygon("block", SQUARE * [2.0, 0.5], gravity=gravity), FLOOR
    else:
        body, wall = brick("block", [-0.5, -0.5, 0.0], [0.5, 0.5, 0.3], gravity=gravity), FLOOR_3D
    bodies = field([body], [RigidPair(0, wall, 0.3)])
    for t, _ in march(bodies, 0.5, 25):
        assert bodies.now[0].shift[dim - 2] == pytest.approx(0.5 * a * t**2, abs=1e-9)
    assert bodies.now[0].v[dim - 2] == pytest.approx(0.5 * a, abs=1e-9)
    weight = body.inertia.mass * GRAVITY * np.cos(angle)
    assert bodies.contact.force[dim - 1] == pytest.approx(weight, rel=1e-9)
    share = bodies.contact.force[dim - 2] / weight
    assert share == pytest.approx(-min(np.tan(angle), 0.3), rel=1e-8)


def test_a_sliding_block_stops():
    """It comes to rest after v^2 / (2 mu g), turns no more, and does not slide back."""
    body = brick("block", [-0.5, -0.5, 0.0], [0.5, 0.5, 0.2], gravity=(0, 0, -GRAVITY), initial_velocity=(0.6, 0.8, 0))
    ways = []
    for steps in (40, 80):
        bodies = field([body], [RigidPair(0, FLOOR_3D, 0.2)])
        for _ in march(bodies, 0.8, steps):
            pass
        assert np.abs(bodies.now[0].v).max() < 1e-9
        ways.append(bodies.now[0].shift)
    assert ways[0] == pytest.approx([0.15, 0.2, 0.0], abs=5e-3)
    assert ways[1] == pytest.approx([0.15, 0.2, 0.0], abs=2e-3)


@pytest.mark.parametrize("push", [0.7, 1.3])
def test_a_block_tips_where_it_must(push):
    """A block of width 0.5 and height 1 on a rough slope tips from tan(angle) = 0.5 on."""
    angle = np.arctan(0.5 * push)
    bodies = field([polygon("block", SQUARE * [0.5, 1.0], gravity=slope(angle))], [RigidPair(0, FLOOR, 2.0)])
    for _ in march(bodies, 0.3, 30):
        pass
    if push < 1.0:
        assert bodies.now[0].shift == pytest.approx([0.0, 0.0, 0.0], abs=1e-10)
    else:
        assert bodies.now[0].R[0, 1] > 0.01  # it turns over its lower corner, which stays
        corner = bodies.displacement()[1]
        assert corner == pytest.approx([0.0, 0.0], abs=1e-7)


@pytest.mark.parametrize("finest", [192, pytest.param(384, marks=pytest.mark.slow)])
def test_a_disc_rolls_down_a_slope(finest):
    """2/3 g sin a for a disc; a polygon of n sides loses energy at each corner: the error falls with 1 / n."""
    angle, errors = 0.3, []
    for n in (finest // 2, finest):
        body = disc("disc", (0.0, 0.5 * np.cos(np.pi / n)), n=n, turned=np.pi / n - np.pi / 2, gravity=slope(angle))
        bodies = field([body], [RigidPair(0, FLOOR, 0.5)])
        for _ in march(bodies, 0.8, 80):
            pass
        way = 0.5 * 2.0 / 3.0 * GRAVITY * np.sin(angle) * 0.8**2
        errors.append(bodies.now[0].shift[0] / way - 1.0)
        turned = np.arctan2(bodies.now[0].R[0, 1], bodies.now[0].R[0, 0])
        assert 0.5 * turned == pytest.approx(bodies.now[0].shift[0], rel=1e-3)
    assert abs(errors[1]) < 0.55 * abs(errors[0])
    assert finest < 384 or abs(errors[1]) < 0.005


def test_a_ball_rolls_down_a_slope():
    """g sin a / (1 + J / (m r^2)), which is 5/7 g sin a for a ball of infinitely many facets."""
    angle, n = 0.3, 128
    body = ball("ball", (0.0, 0.0, 0.5), n=n, gravity=slope(angle, 3))
    rolls = body.inertia.tensor[0, 0] / (body.inertia.mass * 0.5**2)
    assert rolls == pytest.approx(0.4, rel=0.03)
    bodies = field([body], [RigidPair(0, FLOOR_3D, 0.5)])
    for _ in march(bodies, 0.8, 40):
        pass
    way = 0.5 * GRAVITY * np.sin(angle) / (1.0 + rolls) * 0.8**2
    assert bodies.now[0].shift[1] == pytest.approx(way, rel=0.02)
    assert bodies.now[0].shift[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("friction", "slides"), [(0.3, False), (0.15, True)])
def test_a_disc_slides_beyond_the_known_angle(friction, slides):
    """Where tan a > 3 mu it slides with g (sin a - mu cos a), and turns by the moment of the friction."""
    angle, n = 0.6, 192
    body = disc("disc", (0.0, 0.5 * np.cos(np.pi / n)), n=n, turned=np.pi / n - np.pi / 2, gravity=slope(angle))
    bodies = field([body], [RigidPair(0, FLOOR, friction)])
    for _ in march(bodies, 0.5, 25):
        pass
    turned = 0.5 * np.arctan2(bodies.now[0].R[0, 1], bodies.now[0].R[0, 0])
    way = 0.5 * GRAVITY * (np.sin(angle) - friction * np.cos(angle)) * 0.5**2
    if slides:
        assert bodies.now[0].shift[0] == pytest.approx(way, rel=0.005)
        assert turned == pytest.approx(0.25 * friction * GRAVITY * np.cos(angle), rel=0.03)  # 2 mu g cos a / r
    else:
        assert bodies.now[0].shift[0] == pytest.approx(2.0 / 6.0 * GRAVITY * np.sin(angle) * 0.5**2, rel=0.01)
        assert turned == pytest.approx(bodies.now[0].shift[0], rel=2e-3)


def test_bodies_with_friction_jam_or_say_so():
    """A high block slides with a friction for which its front corner has no finite force (Painleve)."""
    body = polygon("tower", SQUARE * [1.0, 3.0], gravity=(0.0, -GRAVITY), initial_velocity=(1.0, 0.0))
    bodies = field([body], [RigidPair(0, FLOOR, 2.0)])
    bodies.initialise(0.0, 0.01)
    with pytest.raises(StepFailed, match="no contact force holds 'tower': rigid bodies that slide with so") as failed:
        bodies.step(0.0, 0.01)
    require_advice(failed.value, FailureKind.JAMMED)
    bodies = field([body], [RigidPair(0, FLOOR, 0.3)])
    bodies.initialise(0.0, 0.01)
    bodies.step(0.0, 0.01)
    assert bodies.now[0].v[0] == pytest.approx(1.0 - 0.03, abs=1e-9)


@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("friction", [0.05, 5.0])
def test_an_oblique_collision_with_friction(restitution, friction):
    """Two discs, a corner against a side: momentum is kept, spins have the moment of the impulse, and velocities at
    the corner are those of the laws of Newton and Coulomb."""
    one = disc("one", (0.0, 0.0), n=6, turned=0.0, initial_velocity=(2.0, 0.4))
    two = disc("two", (1.01, 0.05), n=6, turned=np.pi / 6, density=1.0, initial_velocity=(-1.0, 0.0))
    bodies = field([one, two], [RigidPair(0, 1, friction)], rho_inf=1.0, restitution=restitution)
    bodies.initialise(0.0, 0.01)
    before = momenta(bodies)
    for n in range(10):
        was = list(bodies.now)
        bodies.step(0.01 * n, 0.01)
        if bodies.in_contact():
            break
    np.testing.assert_allclose(momenta(bodies)[:2], before[:2], rtol=1e-10)
    corner = one.inertia.centre + bodies.now[0].shift[:2] + bodies.now[0].R[:2, :2] @ [0.5, 0.0]
    centres = [body.inertia.centre + now.shift[:2] for body, now in zip((one, two), bodies.now, strict=True)]
    relative, impulse = [], one.inertia.mass * (bodies.now[0].v[:2] - was[0].v[:2])
    for instants in (was, bodies.now):
        v = [
            now.v[:2] + now.v[5] * np.array([[0.0, -1.0], [1.0, 0.0]]) @ (corner - at)
            for now, at in zip(instants, centres, strict=True)
        ]
        relative.append(v[0] - v[1])
    for body, old, now, sign in zip((one, two), was, bodies.now, (1.0, -1.0), strict=True):
        arm = corner - body.inertia.centre - now.shift[:2]
        moment = sign * (arm[0] * impulse[1] - arm[1] * impulse[0])
        assert body.inertia.tensor[2, 2] * (now.v[5] - old.v[5]) == pytest.approx(moment, rel=1e-9)
    normal, tangent = bodies.contact.near.frame[bodies.contact.active][0]
    assert relative[1] @ normal == pytest.approx(-restitution * (relative[0] @ normal), abs=1e-9)
    if friction > 1.0:
        assert relative[1] @ tangent == pytest.approx(0.0, abs=1e-9)
    else:
        against = -np.sign(relative[1] @ tangent) * np.sign(normal @ impulse)
        assert impulse @ tangent == pytest.approx(friction * against * (impulse @ normal), rel=1e-9)


def test_a_belt_carries_a_block():
    """A driven table that slides below a block pulls it with the friction until it has the speed of the table."""
    plate = np.array([[4.0, 0.0], [-4.0, 0.0]])
    table = Obstacle("table", plate, np.array([[0, 1]]), motion=lambda t: plate + np.array([0.5 * t, 0.0]))
    bodies = field([polygon("block", SQUARE, gravity=(0.0, -GRAVITY))], [RigidPair(0, table, 0.2)])
    for t, _ in march(bodies, 0.4, 40):
        assert bodies.now[0].v[0] == pytest.approx(min(2.0 * t, 0.5), abs=1e-9)


def test_contact_forces_turn_with_the_bodies():
    """The tangent's part of contact against differences of the resultants, the forces fixed in the frames."""
    wedge = disc("below", (0.1, -0.3), radius=0.6, n=5, turned=0.2)
    bodies = field([disc("above", (0.0, 0.45), n=4, turned=0.1), wedge], [RigidPair(0, 1, 0.4)])
    bodies.initialise(0.0, 0.1)
    bodies.begin_step(0.0, 0.1)
    contact, rng, h = bodies.contact, np.random.default_rng(3), 1e-6
    bodies.residual()
    inside = np.abs(contact.near.gap) < 0.2
    z = np.where(inside[:, None], rng.random(contact.z.shape), 0.0)
    vertex, names = contact.near.vertex, contact.near.names()
    contact._pressing = names, np.einsum("mde,md->me", contact.near.frame, z)
    u = bodies.increments()

    def force(shift) -> np.ndarray:
        moved = u.copy()
        moved[:, [0, 1, 5]] += shift.reshape(2, 3)
        bodies.set_increments(moved)
        bodies.residual()
        assert (contact.near.vertex == vertex).all()
        return contact.touch.force(z, bodies.unknowns)

    for column in range(6):
        step = np.zeros(6)
        step[column] = h
        difference = (force(step) - force(-step)) / (2.0 * h)
        bodies.set_increments(u)
        contact._pressing = names, np.einsum("mde,md->me", contact.near.frame, z)
        contact.measure(contact._moment, bodies.components, bodies._free)
        assert -contact.stiffness.toarray()[:, column] == pytest.approx(difference, abs=1e-6)


def pile(count: int, order=None, columns: int = 5, friction: float = 0.3) -> RigidBodies:
    """Discs above the floor of a box, in rows that are not quite regular."""
    rng, right = np.random.default_rng(1), 1.2 * columns - 0.8
    sides = [
        RigidWall("left", np.array([-0.8, 0.0]), np.array([1.0, 0.0])),
        RigidWall("right", np.array([right, 0.0]), np.array([-1.0, 0.0])),
    ]
    places = [(1.15 * (k % columns) + 0.1 * rng.random(), 0.6 + 1.1 * (k // columns)) for k in range(count)]
    discs = [disc(f"d{k}", at, n=16, turned=rng.random(), gravity=(0, -GRAVITY)) for k, at in enumerate(places)]
    discs = [discs[k] for k in order or range(count)]
    pairs = [RigidPair(a, b, friction) for b in range(count) for a in range(b)]
    pairs += [RigidPair(a, wall, friction) for a in range(count) for wall in (FLOOR, *sides)]
    bodies = field(discs, pairs)
    bodies.tolerance = Tolerance(1e-9)
    return bodies


def overlap(bodies: RigidBodies) -> float:
    """Deepest overlap [m] of vertices with other bodies and with walls, found anew at the end of the step."""
    contact = bodies.contact
    return -float(search(contact.pairs, contact._starts, contact._moment).gap.min(initial=0.0))


@pytest.mark.slow
def test_fifty_discs_fall_in_a_box():
    """No overlap and few Newton steps in the first second, in which most of the discs hit each other."""
    bodies = pile(50)
    for _, info in march(bodies, 1.0, 100):
        assert info.iterations <= 8
        assert overlap(bodies) < 1e-6 * 0.5


def test_a_few_discs_in_a_box_whatever_their_order():
    """The same motion for any order of bodies, and bit for bit after a restart; no overlap."""
    ends, saved, once = {}, {}, []
    for order in ([3, 0, 5, 1, 4, 2], range(6)):
        bodies = pile(6, list(order), columns=2)
        for number, (_, info) in enumerate(march(bodies, 0.5, 50), 1):
            assert info.iterations <= 8
            assert overlap(bodies) < 1e-6 * 0.5
            if number == 30:
                saved = bodies.save()
            if number == 40:
                once = [{name: a.copy() for name, a in now.arrays().items()} for now in bodies.now]
        for body, now in zip(bodies.bodies, bodies.now, strict=True):
            ends.setdefault(body.name, []).append(np.concatenate([now.shift, now.v]))
    for one, other in ends.values():
        assert other == pytest.approx(one, abs=1e-9)
    again = pile(6, columns=2)
    again.restore(saved)
    for n in range(30, 40):
        again.step(0.01 * n, 0.01)
    for arrays, now in zip(once, again.now, strict=True):
        assert all(np.array_equal(a, now.arrays()[name]) for name, a in arrays.items())


def test_discs_on_each_other_press_by_their_weight():
    """Three discs on each other between walls: at rest, the floor carries the weight to 1e-6."""
    places = [(0.0, 0.5), (0.0, 1.5), (0.0, 2.5)]
    turned = np.pi / 16
    r = 0.5 / np.cos(np.pi / 16)
    discs = [disc(f"d{k}", at, radius=r, n=16, turned=turned, gravity=(0, -GRAVITY)) for k, at in enumerate(places)]
    pairs = [RigidPair(0, FLOOR, 0.5), RigidPair(0, 1, 0.5), RigidPair(1, 2, 0.5)]
    bodies = field(discs, pairs)
    for _ in march(bodies, 0.3, 15):
        pass
    weight = discs[0].inertia.mass * GRAVITY
    assert bodies.contact.force[1::3] == pytest.approx([weight] * 3, rel=1e-6)
    on_floor = bodies.contact.near.body[:, 1] < 0
    assert bodies.contact.z[on_floor, 0].sum() == pytest.approx(3.0 * weight, rel=1e-6)


def test_bodies_that_touch_nothing_cost_no_pairs():
    """The search looks at vertices of bodies that are near each other: twice as many bodies, twice the work."""
    counts = []
    for count in (10, 20):
        bodies = pile(count)
        bodies.initialise(0.0, 0.01)
        bodies.begin_step(0.0, 0.01)
        bodies.residual()
        counts.append(len(bodies.contact.z))
        assert len(bodies._system().data) <= 9 * count + 36 * counts[-1]
    assert counts[1] <= 2.3 * counts[0]
