"""Rigid bodies whose edges cross: no vertex of one is on the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Tolerance
from solvers.rigid import motion
from solvers.rigid.body import PointLoad, RigidBody
from solvers.rigid.contact import Obstacle, RigidContact, RigidPair
from solvers.rigid.field import RigidBodies
from solvers.rigid.inertia import inertia_of_surface
from solvers.rigid.motion import RigidInstant
from solvers.rigid.near import Moment, Near, search
from solvers.rigid.rotation import rotation
from solvers.rigid.turning import turning

CORNERS = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]) - 0.5
SIDES = np.array(
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
     [1, 3, 5], [3, 7, 5]]
)  # fmt: skip
HELD = {name: (lambda t: 0.0) for name in ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")}
G = 10.0


def corners(size, at, turn=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Of a box [m] around a point, turned about it by angles about x, y, z [degrees]."""
    return CORNERS * np.array(size) @ Rotation.from_euler("xyz", turn, degrees=True).as_matrix().T + np.array(at)


def box(name, size, at, turn=(0.0, 0.0, 0.0), scale=1.0, density=8.0, **settings) -> RigidBody:
    points = scale * corners(size, at, turn)
    gravity = settings.pop("gravity", (0.0, 0.0, -G * scale))
    return RigidBody(name, points, SIDES, inertia_of_surface(points, SIDES, density), gravity=gravity, **settings)


def weight(body: RigidBody) -> float:
    return body.inertia.mass * float(np.linalg.norm(body.gravity))


def run(bodies, pairs, steps=40, dt=0.02, restitution=0.0, rho_inf=1.0) -> RigidBodies:
    contact = RigidContact(bodies, pairs, restitution=restitution)
    found = RigidBodies(bodies, GeneralisedAlpha.from_rho_inf(rho_inf), Tolerance(1e-12), contact=contact)
    found.initialise(0.0, dt)
    for n in range(steps):
        found.step(n * dt, dt)
    return found


def pushed(found: RigidBodies, index: int = 0) -> np.ndarray:
    """Force and moment of contact on a body [N, N m]."""
    return found.contact.whole_force.reshape(len(found.bodies), -1)[index]


@pytest.mark.parametrize(
    ("order", "scale"),
    [
        ((0, 1), 1.0),
        ((1, 0), 1e-3),
        *(pytest.param(*other, marks=pytest.mark.slow) for other in (((0, 1), 1e-3), ((1, 0), 1.0))),
    ],
)
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.0, 0.0, 20.0), (3.0, 0.0, 0.0)])
def test_a_bar_rests_across_another_one(order, scale, turn):
    """It falls, turns onto its side if it is tilted, and lies on all four points where edges cross."""
    upper = box("upper", (4.0, 0.5, 0.5), (0.03, 0.02, 0.83), turn, scale)
    lower = box("lower", (0.5, 4.0, 0.5), (0.0, 0.0, 0.25), scale=scale, held=HELD)
    found = run([(upper, lower)[k] for k in order], [RigidPair(0, 1, 0.3)])
    on = order.index(0)
    assert pushed(found, on)[:3] == pytest.approx([0.0, 0.0, weight(upper)], abs=1e-9 * weight(upper))
    assert pushed(found, on)[3:] == pytest.approx(np.zeros(3), abs=1e-9 * scale * weight(upper))
    assert pushed(found, 1 - on)[:3] == pytest.approx([0.0, 0.0, -weight(upper)], abs=1e-9 * weight(upper))
    assert found.contact.active.sum() == 4
    assert upper.inertia.centre[2] + found.now[on].shift[2] == pytest.approx(0.75 * scale, abs=1e-9 * scale)
    assert np.abs(found.now[on].v).max() < 1e-9


def test_a_bar_lies_across_an_obstacle_that_rises():
    lower = corners((0.5, 4.0, 0.5), (0.0, 0.0, 0.25))
    rising = Obstacle("lower", lower, SIDES, lambda t: lower + np.array([0.0, 0.0, 0.3 * t]))
    upper = box("upper", (4.0, 0.5, 0.5), (0.03, 0.02, 0.75))
    found = run([upper], [RigidPair(0, rising, 0.3)])
    assert found.now[0].v[:3] == pytest.approx([0.0, 0.0, 0.3], abs=1e-9)
    assert found.now[0].shift == pytest.approx([0.0, 0.0, 0.3 * 0.8], abs=1e-9)
    assert pushed(found)[:3] == pytest.approx([0.0, 0.0, weight(upper)], abs=1e-9 * weight(upper))


def test_a_bar_lies_across_the_rims_of_an_open_plate():
    """A surface without thickness: its rims have one facet."""
    plate = np.array([[-0.25, -2.0, 0.5], [0.25, -2.0, 0.5], [0.25, 2.0, 0.5], [-0.25, 2.0, 0.5]])
    upper = box("upper", (4.0, 0.5, 0.5), (0.03, 0.02, 0.8))
    found = run([upper], [RigidPair(0, Obstacle("plate", plate, np.array([[0, 1, 2], [0, 2, 3]])), 0.3)])
    assert pushed(found) == pytest.approx([0.0, 0.0, weight(upper), 0.0, 0.0, 0.0], abs=1e-9 * weight(upper))
    assert upper.inertia.centre[2] + found.now[0].shift[2] == pytest.approx(0.75, abs=1e-9)


@pytest.mark.parametrize("beside", [(), (1e5, 3.0)], ids=["alone", "heavy body far away"])
def test_a_beam_on_two_ridges_loads_them_by_its_levers(beside):
    ridges = [
        box(f"ridge{k}", (0.2, 2.0, 0.2), (x, 0.0, -0.1 * np.sqrt(2.0)), (0.0, 45.0, 0.0), held=HELD)
        for k, x in enumerate((-1.0, 0.6))
    ]
    beam = box("beam", (4.0, 0.5, 0.3), (0.0, 0.1, 0.15))
    others = [box("far", (1.0, 1.0, 1.0), (200.0, 0.0, 0.0), density=beside[0])] if beside else []
    bodies = [beam, *ridges, *others]
    found = run(bodies, [RigidPair(i, j, 0.2) for j in range(len(bodies)) for i in range(j)], steps=10)
    for index, share in ((1, 0.6 / 1.6), (2, 1.0 / 1.6)):
        assert pushed(found, index)[2] == pytest.approx(-share * weight(beam), rel=1e-9)
    assert np.abs(found.now[0].shift).max() < 1e-12


@pytest.mark.parametrize("tips", [False, True])
def test_a_plate_stands_on_the_octagon_that_it_shares_with_another_one(tips):
    """The corners of both stand out. A load near the middle of a side tips the plate if it is beyond this side."""
    lower = box("lower", (1.0, 1.0, 0.2), (0.0, 0.0, -0.1), held=HELD)
    at = 0.505 if tips else 0.495
    load = PointLoad(lambda t: np.array([0.0, 0.0, -1e4]), lambda t: np.zeros(3), (at, 0.0, 0.2))
    upper = box("upper", (1.0, 1.0, 0.2), (0.0, 0.0, 0.1), (0.0, 0.0, 45.0), loads=[load])
    found = run([upper, lower], [RigidPair(0, 1)], steps=10, dt=0.002)
    if tips:
        assert found.now[0].R[0, 2] > 1e-3
        return
    assert pushed(found)[2] == pytest.approx(1e4 + weight(upper), rel=1e-9)
    assert pushed(found)[4] == pytest.approx(-1e4 * at, rel=1e-9)
    assert found.now[0].R == pytest.approx(np.eye(3), abs=1e-9)


@pytest.mark.parametrize("angle", [1e-7, 1e-3, 30.0])
def test_a_block_stands_on_an_equal_one_that_is_turned(angle):
    lower = box("lower", (1.0, 1.0, 1.0), (0.0, 0.0, -0.5), held=HELD)
    upper = box("upper", (1.0, 1.0, 1.0), (0.0, 0.0, 0.55), (0.0, 0.0, angle))
    found = run([upper, lower], [RigidPair(0, 1)], steps=20)
    assert pushed(found)[2] == pytest.approx(weight(upper), rel=1e-9)
    assert found.now[0].R == pytest.approx(np.eye(3), abs=1e-9)


@pytest.mark.parametrize("friction", [0.0, 0.2, 0.6])
def test_a_bar_slides_down_two_rails(friction):
    """a = g (sin 25 - mu cos 25), at rest with mu above tan 25."""
    slope = np.radians(25.0)
    down, up = np.array([0.0, np.cos(slope), np.sin(slope)]), np.array([0.0, -np.sin(slope), np.cos(slope)])
    rails = [
        box(f"rail{k}", (0.2, 8.0, 0.2), -0.1 * up + [x, 0, 0], (25.0, 0, 0), held=HELD) for k, x in enumerate((-1, 1))
    ]
    bar = box("bar", (3.0, 0.5, 0.5), 0.25 * up, (25.0, 0.0, 0.0))
    found = run([bar, *rails], [RigidPair(0, 1, friction), RigidPair(0, 2, friction)], steps=25)
    a = max(np.sin(slope) - friction * np.cos(slope), 0.0) * G
    assert found.now[0].v[:3] == pytest.approx(-a * 0.5 * down, abs=1e-9)
    assert pushed(found)[:3] @ up == pytest.approx(np.cos(slope) * weight(bar), rel=1e-9)


@pytest.mark.parametrize(
    ("order", "restitution"),
    [
        ((0, 1), 0.0),
        ((1, 0), 0.5),
        ((0, 1), 1.0),
        *(pytest.param(*other, marks=pytest.mark.slow) for other in (((1, 0), 0.0), ((0, 1), 0.5), ((1, 0), 1.0))),
    ],
)
def test_edges_collide(restitution, order):
    """Momentum and spin by the impulse along the normal of both edges; Newton's law for the points that meet."""
    upper = box("upper", (2.0, 0.5, 0.5), (0.2, 0.1, 0.8), (45.0, 5.0, 10.0), gravity=(0, 0, 0),
                initial_velocity=(0.1, 0.0, -1.0), initial_spin=(0.1, 0.2, 0.3))  # fmt: skip
    lower = box("lower", (0.5, 2.0, 0.5), (0.0, 0.0, 0.0), (0.0, 45.0, 0.0), density=3.0, gravity=(0, 0, 0))
    bodies = [(upper, lower)[k] for k in order]
    contact = RigidContact(bodies, [RigidPair(0, 1)], restitution=restitution)
    found = RigidBodies(bodies, GeneralisedAlpha.from_rho_inf(1.0), Tolerance(1e-12), contact=contact)
    found.initialise(0.0, 0.002)
    for n in range(100):
        was = list(found.now)
        found.step(0.002 * n, 0.002)
        if found.in_contact():
            break
    assert found.contact.active.sum() == 1
    near = contact.near[contact.active]
    assert near.edge[0] >= 0
    normal, at = near.frame[0, 0], near.x[0]
    sign = 1.0 if order[0] == 0 else -1.0
    along = []
    for body, turn, way in ((order.index(0), (45, 5, 10), [1.0, 0, 0]), (order.index(1), (0, 45, 0), [0, 1.0, 0])):
        along.append(found.now[body].R @ Rotation.from_euler("xyz", turn, degrees=True).as_matrix() @ way)
    wanted = np.cross(*along)
    assert normal == pytest.approx(sign * wanted / np.linalg.norm(wanted), abs=1e-9)
    closing, gained = [], []
    for body, old, now in zip(bodies, was, found.now, strict=True):
        centre = body.inertia.centre + now.shift
        for instant in (old, now):
            closing.append((instant.v[:3] + np.cross(motion.spin(instant), at - centre)) @ normal)
        gained.append(motion.momentum(body, now.R, now.v) - motion.momentum(body, old.R, old.v))
        assert gained[-1][3:] == pytest.approx(np.cross(at - centre, gained[-1][:3]), abs=1e-9)
    assert gained[0][:3] == pytest.approx(-gained[1][:3], abs=1e-9)
    assert np.cross(gained[0][:3], normal) == pytest.approx(np.zeros(3), abs=1e-9)
    assert closing[1] - closing[3] == pytest.approx(-restitution * (closing[0] - closing[2]), abs=1e-9)


def test_forces_turn_with_edges():
    """The derivative of the resultants of a constant normal force, against differences."""
    bodies = [
        box("one", (4, 0.5, 0.5), (0.03, 0.02, 0.73), (10, 15, 30)),
        box("two", (0.5, 4, 0.5), (0, 0, 0), (-7, 20, 5)),
    ]
    rest, unknowns, free, h = RigidInstant.at_rest(), np.arange(6), np.ones(12, dtype=bool), 1e-6

    def at(u: np.ndarray) -> tuple[Moment, Near]:
        now = [replace(rest, shift=own[:3], R=rotation(own[3:])) for own in u.reshape(2, 6)]
        moment = Moment(bodies, now, [rest, rest], 0.1, 0.1)
        near = search([RigidPair(0, 1)], [0, 16], moment)
        return moment, near[near.edge >= 0]

    moment, near = at(np.zeros(12))
    assert len(near.gap) == 1
    assert near.gap[0] > 0.1
    force = near.frame[:, 0] * 1.7
    found = turning(near, force, moment, unknowns, free).toarray()
    for column in range(12):
        step = h * np.eye(12)[column]
        ends = []
        for moment, near in (at(step), at(-step)):
            ends.append(near.touch(moment, unknowns, free).force(np.array([[1.7, 0.0, 0.0]]), 12))
        assert found[:, column] == pytest.approx((ends[0] - ends[1]) / (2.0 * h), abs=1e-8)
