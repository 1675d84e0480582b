"""Rigid bodies with pivots, loads, and springs between them: exact motions, conserved quantities, derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from solvers.generalised_alpha import GeneralisedAlpha
from solvers.march import march
from solvers.newton import Tolerance
from solvers.rigid import motion, probes
from solvers.rigid.body import PointLoad, PointSpring, RigidBody, hinged
from solvers.rigid.contact import Obstacle, RigidContact, RigidPair
from solvers.rigid.field import RigidBodies
from solvers.rigid.inertia import inertia_of_surface
from solvers.rigid.line_springs import LineSpring
from solvers.spring_law import SpringLaw

TIGHT = Tolerance(1e-12)
CUBE = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
SIDES = np.array(
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
     [1, 3, 5], [3, 7, 5]]
)  # fmt: skip


def rectangle(low, high, density=3.0, name="bar", **settings) -> RigidBody:
    (x, y), (X, Y) = low, high
    points, facets = np.array([[x, y], [X, y], [X, Y], [x, Y]]), np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    return RigidBody(name, points, facets, inertia_of_surface(points, facets, density), **settings)


def box(low, size, density=3.0, name="box", **settings) -> RigidBody:
    points = np.array(low) + CUBE * size
    return RigidBody(name, points, SIDES, inertia_of_surface(points, SIDES, density), **settings)


def field(*bodies: RigidBody, rho_inf: float = 1.0, **settings) -> RigidBodies:
    return RigidBodies(bodies, GeneralisedAlpha.from_rho_inf(rho_inf), TIGHT, **settings)


def turned(points, axis, angle):
    """Points turned about the origin."""
    from solvers.rigid.rotation import rotation

    return points @ rotation(angle * np.array(axis, dtype=float)).T


# ------------------------------------------------------------------------------------------------------------ pivot


def swing(steps: int, amplitude: float, rho_inf: float = 1.0, periods: float = 1.0):
    """Angle of a bar, hinged at its end and let go at an amplitude, after some exact periods."""
    g, bar = 10.0, rectangle((-0.05, -1.0), (0.05, 0.0))
    points = turned(np.pad(bar.points, ((0, 0), (0, 1))), (0, 0, 1), amplitude)[:, :2]
    body = replace(bar, points=points, inertia=inertia_of_surface(points, bar.facets, 3.0), gravity=(0.0, -g))
    about = 1.0 / 3.0 * 1.0025  # moment of inertia over the mass: (l^2 + b^2) / 12 + l^2 / 4 = (4 + 0.01) / 12
    period = 4.0 * ellipk(np.sin(0.5 * amplitude) ** 2) / np.sqrt(g * 0.5 / about)
    bodies = field(hinged(body, (0.0, 0.0)), rho_inf=rho_inf)
    for _ in march(bodies, periods * period, steps):
        pass
    return bodies, float(np.arctan2(*bodies.now[0].R[[1, 0], 0])), period


@pytest.mark.parametrize("rho_inf", [1.0, 0.5])
def test_a_physical_pendulum_has_the_period_of_the_elliptic_integral(rho_inf):
    """Let go at 120 degrees: after a period, it is where it was; the exact angle all the way, with second order."""
    errors = []
    for steps in (50, 100):
        _, angle, period = swing(steps, 2.0 * np.pi / 3.0, rho_inf, 0.3)
        k, omega = np.sin(np.pi / 3.0), 4.0 * ellipk(np.sin(np.pi / 3.0) ** 2) / period
        sn = ellipj(ellipk(k**2) - omega * 0.3 * period, k**2)[0]
        errors.append(abs(angle + 2.0 * np.pi / 3.0 - 2.0 * np.arcsin(k * sn)))
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_a_pendulum_comes_back_after_two_periods_and_keeps_its_energy():
    bodies, angle, _ = swing(200, 1.0, periods=2.0)
    assert abs(angle) < 1e-2
    body, now = bodies.bodies[0], bodies.now[0]
    height = float((now.R @ body.inertia.offset - body.inertia.offset)[1])
    energy = motion.kinetic_energy(body, now) + body.inertia.mass * 10.0 * height
    assert abs(energy) < 1e-4 * body.inertia.mass * 10.0


def test_the_pivot_stays_and_probes_are_of_the_centre_of_mass():
    bodies, _, _ = swing(50, 1.0, periods=0.2)
    at_pivot, centre = probes.at_point(bodies, 0, "displacement", (0.0, 0.0)), probes.of_body(bodies, 0, "centre")
    assert at_pivot() == {"x": 0.0, "y": 0.0}
    place, spin, mass = np.array(list(centre().values())), bodies.now[0].v[5], bodies.bodies[0].inertia.mass
    assert np.linalg.norm(place) == pytest.approx(0.5, rel=1e-13)
    momentum = np.array(list(probes.of_body(bodies, 0, "momentum")().values()))
    assert momentum == pytest.approx(mass * spin * np.array([-place[1], place[0]]), rel=1e-12)
    turning = probes.of_body(bodies, 0, "angular_momentum")()[""]
    assert turning == pytest.approx(mass * spin * 4.01 / 12.0, rel=1e-12)


def test_a_door_hangs_on_an_axis_that_is_no_axis_of_its_inertia():
    """Skew box on an upright axis, pushed by a moment: J_zz about the axis counts alone, J_xz makes no turn."""
    points = turned(np.array([0.2, 0.3, -0.5]) + CUBE * [1.0, 0.2, 2.0], (1.0, 0.5, 0.0), 0.4)
    inertia = inertia_of_surface(points, SIDES, 3.0)
    push = PointLoad(lambda t: np.zeros(3), lambda t: np.array([3.0, -2.0, 4.0]))
    held = {"rotation_x": lambda t: 0.0, "rotation_y": lambda t: 0.0}
    body = hinged(RigidBody("door", points, SIDES, inertia, held=held, loads=[push]), (0.0, 0.0, 0.0))
    c, J = inertia.centre, inertia.tensor[2, 2]
    bodies = field(body)
    for t, _ in march(bodies, 1.0, 20):
        angle = 0.5 * t**2 * 4.0 / (J + inertia.mass * (c[0] ** 2 + c[1] ** 2))
        assert bodies.displacement() == pytest.approx(turned(points, (0, 0, 1), angle) - points, abs=1e-10)


def test_a_top_on_a_fixed_point_keeps_its_energy_and_vertical_angular_momentum():
    """Free to turn about a corner, under gravity along z: energy to second order, the momentum about z by its law."""
    drifts = []
    for steps in (50, 100):
        body = hinged(box((0.0, 0.0, 0.0), (1.0, 0.4, 0.6), gravity=(0.0, 0.0, -10.0)), (0.0, 0.0, 0.0))
        body = replace(body, initial_spin=(1.0, 2.0, 6.0))
        bodies = field(body)

        def energy(bodies=bodies, body=body):
            now = bodies.now[0]
            weight = body.inertia.mass * 10.0 * (now.R @ body.inertia.offset)[2]
            return motion.kinetic_energy(body, now) + weight

        bodies.initialise(0.0, 1.0 / steps)
        before, spin = energy(), probes.of_body(bodies, 0, "angular_momentum")()["z"]
        for n in range(steps):
            bodies.step(n / steps, 1.0 / steps)
        assert probes.of_body(bodies, 0, "angular_momentum")()["z"] == pytest.approx(spin, rel=1e-11)
        drifts.append(abs(energy() - before) / before)
    assert drifts[1] < 2e-3
    assert drifts[0] / drifts[1] == pytest.approx(4.0, rel=0.3)


def test_a_hinged_bar_that_hits_a_stop_comes_to_rest_there():
    """The moment of the stop about the hinge is that of the weight."""
    stop = Obstacle("stop", np.array([[5.0, -0.3], [-5.0, -0.3]]), np.array([[0, 1]]))
    body = hinged(rectangle((0.0, -0.05), (1.0, 0.05), gravity=(0.0, -10.0)), (0.0, 0.0))
    contact = RigidContact([body], [RigidPair(0, stop)])
    bodies = field(body, contact=contact)
    for _ in march(bodies, 1.0, 100):
        pass
    lowest = (body.points + bodies.displacement())[:, 1].min()
    assert lowest == pytest.approx(-0.3, abs=1e-12)
    assert np.abs(bodies.now[0].v).max() < 1e-12
    lever = (bodies.now[0].R @ body.inertia.offset)[0]
    assert contact.force[2] == pytest.approx(3.0 * 0.1 * 10.0 * lever, rel=1e-10)


def test_a_pivot_does_not_move():
    body = rectangle((0.0, 0.0), (1.0, 1.0), held={"y": lambda t: 0.1 * t})
    with pytest.raises(ValueError, match="a pivot does not move: no motion of 'y' can be given"):
        hinged(body, (0.0, 0.0))


def test_a_held_rotation_is_not_turned_by_an_impact():
    """A skew box, free to turn about z alone, falls on a floor beside its centre: it keeps its other directions."""
    points = turned(CUBE * [1.0, 0.2, 2.0] - [0.5, 0.1, 1.0], (1.0, 0.5, 0.0), 0.4)
    held = {"rotation_x": lambda t: 0.0, "rotation_y": lambda t: 0.0}
    inertia = inertia_of_surface(points, SIDES, 3.0)
    body = RigidBody("box", points, SIDES, inertia, gravity=(0.0, 0.0, -10.0), held=held)
    low = points[:, 2].min() - 0.05
    floor = Obstacle("floor", np.array([[-9.0, -9.0, low], [9.0, -9.0, low], [0.0, 9.0, low]]), np.array([[0, 1, 2]]))
    bodies = field(body, contact=RigidContact([body], [RigidPair(0, floor)]))
    for _ in march(bodies, 0.5, 20):
        now = bodies.now[0]
        assert np.abs(motion.spin(now)[:2]).max() < 1e-12
        assert now.R[2, 2] == pytest.approx(1.0, abs=1e-12)
    assert (points + bodies.displacement())[:, 2].min() == pytest.approx(low, abs=1e-10)


# ------------------------------------------------------------------------------------------------------------ loads


def test_a_force_that_grows_moves_the_centre_and_one_beside_it_turns_the_body():
    """x = F t^3 / 6 m of F t; a moment and a force at a corner: the turn of their sum, at small angles."""
    force = PointLoad(lambda t: np.array([2.0 * t, 0.0, 0.0]), lambda t: np.zeros(3))
    bodies = field(rectangle((0.0, 0.0), (1.0, 1.0), loads=[force]))
    for _ in march(bodies, 1.0, 40):
        pass
    assert bodies.now[0].shift[0] == pytest.approx(2.0 / 18.0, rel=5e-4)
    assert bodies.now[0].R == pytest.approx(np.eye(3), abs=1e-14)
    beside = PointLoad(lambda t: np.array([0.0, 1e-4, 0.0]), lambda t: np.array([0.0, 0.0, 3e-4]), (1.0, 0.0))
    bodies = field(rectangle((0.0, 0.0), (1.0, 1.0), loads=[beside]))
    for _ in march(bodies, 1.0, 10):
        pass
    turn = np.arcsin(bodies.now[0].R[1, 0])
    assert turn == pytest.approx(0.5 * (0.5e-4 + 3e-4) / 0.5, rel=1e-4)  # J = m / 6 = 0.5


# ---------------------------------------------------------------------------------------------------------- springs


def two_masses(steps: int, rho_inf: float = 1.0):
    """Two squares on a spring, stretched: (field, exact stretch at the end, as cos(omega t))."""
    left = rectangle((0.0, 0.0), (1.0, 1.0), 2.0, "left", initial_velocity=(0.3, 0.1))
    right = rectangle((2.0, 0.0), (3.0, 1.0), 5.0, "right", initial_velocity=(0.3, 0.1))
    spring = LineSpring(0, (1.0, 0.5), 1, (2.0, 0.5), SpringLaw(40.0, 0.0, 0.8))
    omega = np.sqrt(40.0 * (2.0 + 5.0) / 10.0)
    bodies = field(left, right, springs=[spring], rho_inf=rho_inf)
    end = 1.7 * 2.0 * np.pi / omega
    for _ in march(bodies, end, steps):
        pass
    return bodies, 0.2 * np.cos(omega * end)


@pytest.mark.parametrize("rho_inf", [1.0, 0.4])
def test_two_masses_on_a_spring_swing_with_their_frequency(rho_inf):
    """omega^2 = k (m1 + m2) / (m1 m2), second order; momentum to rounding."""
    errors = []
    for steps in (50, 100):
        bodies, exact = two_masses(steps, rho_inf)
        stretch = 0.2 + bodies.now[1].shift[0] - bodies.now[0].shift[0]
        errors.append(abs(stretch - exact))
        momentum = sum(body.inertia.mass * now.v[:3] for body, now in zip(bodies.bodies, bodies.now, strict=True))
        assert momentum == pytest.approx(7.0 * np.array([0.3, 0.1, 0.0]), abs=1e-10)
    assert errors[1] < 1e-2 * 0.2 * (1.0 if rho_inf == 1.0 else 3.0)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_a_damper_alone_brings_two_bodies_to_one_speed():
    """v1 - v2 = v0 exp(-c (m1 + m2) t / (m1 m2)) with c = 3."""
    left = rectangle((0.0, 0.0), (1.0, 1.0), 2.0, "left", initial_velocity=(1.0, 0.0))
    right = rectangle((5.0, 0.0), (6.0, 1.0), 5.0, "right")
    bodies = field(left, right, springs=[LineSpring(0, (0.5, 0.5), 1, (5.5, 0.5), SpringLaw(0.0, 3.0, 5.0))])
    for _ in march(bodies, 1.0, 50):
        pass
    speed = bodies.now[0].v[0] - bodies.now[1].v[0]
    assert speed == pytest.approx(np.exp(-3.0 * 0.7), rel=1e-3)


def test_a_spring_to_a_point_at_rest_keeps_its_length_in_a_circle():
    """A stiff tether of length 2 with a body that circles: the stretch carries m v^2 / r."""
    body = rectangle((1.5, -0.5), (2.5, 0.5), 1.0, initial_velocity=(0.0, 3.0), initial_spin=(0.0, 0.0, 1.5))
    bodies = field(body, springs=[LineSpring(0, (2.0, 0.0), None, (0.0, 0.0), SpringLaw(1e4, 100.0, 2.0))], rho_inf=0.5)
    for _ in march(bodies, 2.0, 100):
        pass
    r = float(np.linalg.norm(body.inertia.centre + bodies.now[0].shift[:2]))
    speed = float(np.linalg.norm(bodies.now[0].v[:2]))
    assert (r - 2.0) * 1e4 == pytest.approx(speed**2 / r, rel=0.02)


def test_a_spring_of_no_length_holds_two_bars_together_as_a_hinge():
    """A double pendulum at rest hangs straight: the joint carries the weight of the lower bar."""
    upper = hinged(rectangle((-0.05, -1.0), (0.05, 0.0), gravity=(0.0, -10.0)), (0.0, 0.0))
    lower = rectangle((-0.05, -2.0), (0.05, -1.0), name="lower", gravity=(0.0, -10.0))
    joint = LineSpring(0, (0.0, -1.0), 1, (0.0, -1.0), SpringLaw(1e5, 1e3, 0.0))
    bodies = field(upper, lower, springs=[joint], rho_inf=0.0)
    for _ in march(bodies, 2.0, 40):
        pass
    assert bodies.now[1].shift[1] == pytest.approx(-0.3 * 10.0 / 1e5, rel=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("length", [0.0, 0.7])
def test_the_tangent_against_finite_differences(dim, length):
    """Two bodies, one of them hinged, with springs between them and to a point, loads, gravity, at no solution."""
    rng = np.random.default_rng(5)
    point = lambda: tuple(rng.uniform(size=dim))  # noqa: E731
    load = PointLoad(lambda t: np.array([1.0, -2.0, 0.5 * (dim == 3)]), lambda t: np.zeros(3), point())
    own = {"gravity": (0.3, -4.0, 1.0)[:dim], "loads": [load], "springs": [PointSpring(point(), 5.0, damping=0.3)]}
    if dim == 2:
        one, two = rectangle((0.0, 0.0), (1.0, 0.5), **own), rectangle((1.5, 0.0), (2.0, 1.0), name="other", **own)
    else:
        one, two = box((0, 0, 0), (1.0, 0.5, 0.7), **own), box((1.5, 0, 0), (0.5, 1.0, 0.7), name="other", **own)
    springs = [
        LineSpring(0, point(), 1, point(), SpringLaw(7.0, 0.6, length)),
        LineSpring(1, point(), None, point(), SpringLaw(3.0, 0.2, length)),
    ]
    bodies = field(hinged(one, point()), two, springs=springs, rho_inf=0.6)
    bodies.initialise(0.0, 0.1)
    bodies.step(0.0, 0.1)
    bodies.begin_step(0.1, 0.1)
    start = np.zeros((2, 6))
    n = len(bodies.components)
    start[:, bodies.components] = 0.3 * rng.standard_normal((2, n))
    start[0, :3] = 0.0
    bodies.set_increments(start)
    free = np.ones(2 * n, dtype=bool)
    free[:dim] = False

    def balance(increment):
        bodies.set_increments(start)
        bodies.update(increment)
        bodies.residual()
        return bodies.balance.copy()

    balance(np.zeros(2 * n))
    tangent, h = bodies.tangent().toarray(), 1e-6
    for column in np.flatnonzero(free):
        step = h * np.eye(2 * n)[column]
        found = (balance(step) - balance(-step)) / (2.0 * h)
        assert found[free] == pytest.approx(tangent[free, column], rel=1e-6, abs=1e-6)


def test_an_oblique_hinge_is_a_pivot_and_a_joint_on_its_axis():
    """A door under gravity, as one on an upright axis that is turned with everything else."""
    points, axis = np.array([0.0, -0.1, 0.0]) + CUBE * [1.0, 0.2, 2.0], (1.0, 0.5, 0.3)
    weight, swings = np.array([2.0, -6.0, -3.0]), []
    held = {"rotation_x": lambda t: 0.0, "rotation_y": lambda t: 0.0}
    for angle in (0.0, 1.1):
        x, g = turned(points, axis, angle), turned(weight[None], axis, angle)[0]
        body = RigidBody("door", x, SIDES, inertia_of_surface(x, SIDES, 3.0), gravity=g, held={} if angle else held)
        top = turned(np.array([[0.0, 0.0, 2.0]]), axis, angle)[0]
        joint = [LineSpring(0, top, None, top, SpringLaw(1e9, 1e6, 0.0))] if angle else []
        bodies = field(hinged(body, (0.0, 0.0, 0.0)), springs=joint, rho_inf=0.8)
        for _ in march(bodies, 1.0, 50):
            pass
        swings.append(turned(bodies.displacement(), axis, -angle))
    assert np.abs(swings[0]).max() > 0.5
    assert swings[1] == pytest.approx(swings[0], abs=1e-6)
