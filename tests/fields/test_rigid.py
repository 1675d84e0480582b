"""Rigid bodies without a flow: exact motions, conserved quantities, derivatives, contact."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.api import StepFailed
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.march import march
from solvers.newton import Tolerance
from solvers.rigid import motion, surface
from solvers.rigid.body import PointSpring, RigidBody
from solvers.rigid.contact import Obstacle, RigidContact, RigidPair
from solvers.rigid.field import RigidBodies
from solvers.rigid.gaps import gaps
from solvers.rigid.inertia import Inertia, inertia_of_surface
from solvers.rigid.rotation import rotation, skew, vector_rate

TIGHT = Tolerance(1e-12)
CUBE = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
SIDES = np.array(
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
     [1, 3, 5], [3, 7, 5]]
)  # fmt: skip
TOP = Inertia(2.0, np.array([0.5, 0.5, 0.5]), np.diag([1.0, 2.0, 3.0]))


def cube(inertia: Inertia = TOP, **settings) -> RigidBody:
    return RigidBody("cube", CUBE, SIDES, inertia, **settings)


def square(size: float = 1.0, at=(0.0, 0.0), density: float = 3.0, **settings) -> RigidBody:
    points = size * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) + np.array(at)
    facets = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    return RigidBody("square", points, facets, inertia_of_surface(points, facets, density), **settings)


def field(*bodies: RigidBody, rho_inf: float = 1.0, **settings) -> RigidBodies:
    return RigidBodies(bodies, GeneralisedAlpha.from_rho_inf(rho_inf), TIGHT, **settings)


# --------------------------------------------------------------------------------------------------------- inertia


def test_inertia_of_a_box_and_of_a_rectangle():
    points = CUBE * [1.0, 2.0, 3.0] + [4.0, 5.0, 6.0]
    found = inertia_of_surface(points, SIDES, 7.0)
    assert found.mass == pytest.approx(42.0, rel=1e-14)
    assert found.centre == pytest.approx([4.5, 6.0, 7.5], rel=1e-14)
    assert found.tensor == pytest.approx(42.0 / 12.0 * np.diag([13.0, 10.0, 5.0]), rel=1e-13, abs=1e-12)
    flat = square(2.0, (3.0, 4.0)).inertia
    assert flat.mass == pytest.approx(12.0, rel=1e-14)
    assert flat.centre == pytest.approx([4.0, 5.0], rel=1e-14)
    assert flat.tensor[2, 2] == pytest.approx(12.0 * 8.0 / 12.0, rel=1e-13)


# ---------------------------------------------------------------------------------------------------------- surface


def test_displacements_far_from_the_origin_have_no_larger_rounding_errors():
    """They are divided by time steps: at a distance of 1e6 differences of positions would err by 1e-10."""
    turned = motion.RigidInstant.at_rest()
    turned.shift[:], turned.R[:] = (1e-9, 2e-9, 0.0), rotation(np.array([0.0, 0.0, 1e-9]))
    near, far = (surface.displacements([square(at=at)], [turned]) for at in ((0.0, 0.0), (2.0**20, 2.0**20)))
    exact = np.array([1e-9, 2e-9]) + 1e-9 * np.array([[0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5]])
    assert near == pytest.approx(exact, abs=1e-17)
    assert far == pytest.approx(exact, abs=1e-17)
    moved = surface.positions([square()], [turned])[0] - square().points
    assert near == pytest.approx(moved, abs=1e-15)


# ------------------------------------------------------------------------------------------------------- rotations


@pytest.mark.parametrize("angle", [0.0, 1e-5, 0.999e-3, 1.001e-3, 0.7, 3.0])
def test_rotations_and_the_rate_of_their_vectors(angle):
    rng = np.random.default_rng(1)
    axis, w = rng.standard_normal((2, 3))
    theta = angle * axis / np.linalg.norm(axis)
    R = rotation(theta)
    assert R.T @ R == pytest.approx(np.eye(3), abs=1e-14)
    assert R @ theta == pytest.approx(theta, abs=1e-14)
    h = 1e-5
    by_vector = (rotation(theta + h * vector_rate(theta) @ w) - rotation(theta - h * vector_rate(theta) @ w)) / (2 * h)
    assert by_vector == pytest.approx(skew(w) @ R, abs=1e-8)


# ---------------------------------------------------------------------------------------------------- exact motions


@pytest.mark.parametrize("rho_inf", [1.0, 0.5, 0.0])
def test_free_fall_is_exact(rho_inf):
    """Constant acceleration: x = v t + g t^2 / 2 in every step."""
    bodies = field(cube(gravity=(0.0, 1.0, -9.81), initial_velocity=(2.0, 0.0, 0.0)), rho_inf=rho_inf)
    for t, _ in march(bodies, 1.0, 7):
        exact = np.array([2.0 * t, 0.5 * t**2, -0.5 * 9.81 * t**2])
        assert bodies.now[0].shift == pytest.approx(exact, rel=1e-12)
        assert bodies.displacement() == pytest.approx(np.tile(exact, (8, 1)), rel=1e-12)
    assert bodies.now[0].v[:3] == pytest.approx([2.0, 1.0, -9.81], rel=1e-12)


def test_the_free_top_keeps_angular_momentum_and_energy():
    """Euler's top about its unstable axis: it tumbles, and keeps both for 400 steps of a tenth of a turn."""
    bodies = field(cube(initial_spin=(0.01, 1.0, 0.02)))
    bodies.initialise(0.0, 0.6)
    body, start = bodies.bodies[0], bodies.now[0]
    momentum, energy = motion.momentum(body, start.R, start.v), motion.kinetic_energy(body, start)
    turned = 0.0
    for step in range(400):
        bodies.step(0.6 * step, 0.6)
        now = bodies.now[0]
        turned = max(turned, float(np.abs(now.v[3:] - start.v[3:]).max()))
        assert np.abs(motion.momentum(body, now.R, now.v) - momentum).max() < 1e-10
        assert abs(motion.kinetic_energy(body, now) - energy) < 1e-10
    assert turned > 1.5  # the spin about the unstable axis has changed its sign


def test_a_symmetric_top_precesses_as_the_exact_one():
    """J = (1, 1, 2): the spin turns about the axis with (1 - J_3 / J_1) W_3; second order in the step."""
    errors = []
    for steps in (40, 80):
        inertia = Inertia(1.0, np.array([0.5] * 3), np.diag([1.0, 1.0, 2.0]))
        bodies = field(cube(inertia, initial_spin=(0.3, 0.0, 1.0)))
        for _ in march(bodies, 4.0, steps):
            pass
        exact = 0.3 * np.array([np.cos(4.0), np.sin(4.0)])
        errors.append(np.linalg.norm(bodies.now[0].v[3:5] - exact))
    assert errors[1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("rho_inf", [1.0, 0.0])
def test_a_mass_on_a_spring_swings_with_second_order(rho_inf):
    errors = []
    for steps in (50, 100):
        spring = PointSpring((0.5, 0.5), (12.0, 75.0))
        bodies = field(square(springs=[spring], initial_velocity=(0.2, 0.0)), rho_inf=rho_inf)
        for _ in march(bodies, 2.0, steps):
            pass
        errors.append(abs(bodies.now[0].shift[0] - 0.1 * np.sin(4.0)))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] < 3e-3 * 0.1


def test_a_pendulum_on_stiff_springs_finds_its_rest():
    """Springs at two points hold weight and moment: statics of a beam on two supports."""
    springs = [PointSpring((0.0, 0.0), 1e4, damping=0.05), PointSpring((1.0, 0.0), 1e4, damping=0.05)]
    bodies = field(square(springs=springs, gravity=(0.0, -10.0)), rho_inf=0.0)
    for _ in march(bodies, 4.0, 80):
        pass
    assert bodies.displacement()[:, 1] == pytest.approx(-30.0 / 2e4, rel=1e-6)


def test_held_components_follow_their_functions():
    """A square that is led in x and turned: its corners are where kinematics says, whatever acts on it."""
    body = square(held={"x": lambda t: 0.1 * t, "rotation_z": lambda t: 0.5 * t**2}, gravity=(7.0, -10.0))
    bodies = field(body)
    for t, _ in march(bodies, 1.0, 20):
        angle, r = 0.5 * t**2, body.points - 0.5
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        expected = r @ turn.T - r + [0.1 * t, -5.0 * t**2]
        assert bodies.displacement() == pytest.approx(expected, abs=1e-12)


def test_more_than_half_a_turn_is_refused():
    bodies = field(cube(initial_spin=(0.0, 0.0, 4.0)))
    bodies.initialise(0.0, 1.0)
    with pytest.raises(StepFailed, match="body 'cube' turned by more than half a turn: take a smaller time step"):
        bodies.step(0.0, 1.0)


# ------------------------------------------------------------------------------------------------------ derivatives


@pytest.mark.parametrize("make", [cube, square])
def test_tangent_and_jacobian_against_finite_differences(make):
    """At a state that solves nothing, with springs, dampers and forces on the vertices."""
    rng = np.random.default_rng(3)
    dim = make().dim
    spring = PointSpring(tuple(rng.uniform(size=dim)), 5.0, damping=0.3)
    bodies = field(make(springs=[spring], initial_spin=(0.3, -0.2, 0.4)[: 3 if dim == 3 else 0]), rho_inf=0.6)
    bodies.initialise(0.0, 0.1)
    bodies.step(0.0, 0.1)
    bodies.begin_step(0.1, 0.1)
    start = np.zeros((1, 6))
    start[:, bodies.components] = 0.3 * rng.standard_normal(len(bodies.components))
    bodies.set_increments(start)
    force = rng.standard_normal((len(bodies.bodies[0].points), dim))

    def rows(increment):
        bodies.set_increments(start)
        bodies.update(increment)
        bodies.load(force)
        bodies.residual()
        return bodies.balance.copy(), bodies.displacement().ravel()

    rows(np.zeros(bodies.unknowns))
    tangent, jacobian = bodies.tangent().toarray(), bodies.jacobian()
    matrix = np.zeros((len(jacobian.columns), bodies.unknowns))
    np.put_along_axis(matrix, jacobian.columns, jacobian.values, axis=1)
    h = 1e-6
    for column in range(bodies.unknowns):
        step = h * np.eye(bodies.unknowns)[column]
        plus, minus = rows(step), rows(-step)
        by_balance, by_place = ((a - b) / (2.0 * h) for a, b in zip(plus, minus, strict=True))
        assert by_balance == pytest.approx(tangent[:, column], rel=1e-6, abs=1e-6)
        assert by_place == pytest.approx(matrix[:, column], rel=1e-7, abs=1e-7)


def test_state_is_complete():
    """A restored state goes on bit for bit."""
    make = lambda: field(cube(initial_spin=(0.3, 1.0, 0.1), springs=[PointSpring((1.0, 1.0, 1.0), 3.0)]))  # noqa: E731
    one, two = make(), make()
    for bodies in (one, two):
        bodies.initialise(0.0, 0.1)
    for n in range(3):
        one.step(0.1 * n, 0.1)
    two.restore(one.save())
    for bodies in (one, two):
        bodies.step(0.3, 0.1)
    assert all(np.array_equal(a, two.now[0].arrays()[name]) for name, a in one.now[0].arrays().items())


# ---------------------------------------------------------------------------------------------------------- contact

FLOOR = Obstacle("floor", np.array([[5.0, -1.0], [-5.0, -1.0]]), np.array([[0, 1]]))


def falling_square(rho_inf=1.0, restitution=0.0, **settings) -> RigidBodies:
    body = square(gravity=(0.0, -10.0), **settings)
    contact = RigidContact([body], [RigidPair(0, FLOOR)], restitution=restitution)
    return field(body, rho_inf=rho_inf, contact=contact)


@pytest.mark.parametrize("rho_inf", [1.0, 0.5, 0.0])
def test_a_square_falls_on_the_floor_and_stays(rho_inf):
    """It comes to rest on two corners, which carry its weight, and does not move any more."""
    bodies = falling_square(rho_inf)
    for t, _ in march(bodies, 1.0, 50):
        assert bodies.displacement()[:, 1].min() > -1.0 - 1e-12
        if t < 0.44:
            assert bodies.now[0].shift[1] == pytest.approx(-5.0 * t**2, rel=1e-11)
    assert bodies.displacement() == pytest.approx(np.tile([0.0, -1.0], (4, 1)), abs=1e-11)
    assert bodies.contact.force == pytest.approx([0.0, 30.0, 0.0], rel=1e-9, abs=1e-9)
    assert np.abs(bodies.now[0].v).max() < 1e-12


def test_an_impact_gives_back_the_share_of_its_restitution():
    bodies = falling_square(restitution=0.5)
    highest, fell = -1.0, False
    for t, _ in march(bodies, 0.9, 450):
        fell |= t > np.sqrt(0.2) + 0.01
        if fell:
            highest = max(highest, bodies.now[0].shift[1])
    assert highest == pytest.approx(-0.75, abs=0.01)


def test_a_tilted_square_topples_onto_its_side():
    """It lands on a corner, tips over, and ends on the floor with nothing below it."""
    turned = square(gravity=(0.0, -10.0), initial_velocity=(0.0, 0.0))
    c, s = np.cos(0.3), np.sin(0.3)
    points = (turned.points - 0.5) @ np.array([[c, s], [-s, c]]) + [0.5, 0.0]
    body = RigidBody(
        "square", points, turned.facets, inertia_of_surface(points, turned.facets, 3.0), gravity=(0.0, -10.0)
    )
    bodies = field(body, rho_inf=0.5, contact=RigidContact([body], [RigidPair(0, FLOOR)]))
    for _ in march(bodies, 2.0, 200):
        assert (points + bodies.displacement())[:, 1].min() > -1.0 - 1e-8
    heights = np.sort((points + bodies.displacement())[:, 1])
    assert heights == pytest.approx([-1.0, -1.0, 0.0, 0.0], abs=1e-6)
    assert bodies.contact.force[1] == pytest.approx(30.0, rel=1e-6)


def test_gaps_from_a_triangle():
    """Over its inside, beside an edge and beside a corner, in front of it and behind."""
    triangle = np.array([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]]])
    x = np.array([[0.5, 0.5, 0.3], [0.5, 0.5, -0.3], [1.0, -4.0, 3.0], [-3.0, -4.0, 12.0], [2.0, 2.0, 1.0]])
    found = gaps(x, triangle)
    assert found.gap == pytest.approx([0.3, -0.3, 3.0, 12.0, 1.0], abs=1e-14)
    assert found.normal == pytest.approx(np.tile([0.0, 0.0, 1.0], (5, 1)), abs=1e-14)
    steps = np.array([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], [[2, 0, 1.0], [2, 2, 1.0], [0, 2, 1.0]]])
    nearer = np.array([[1.1, 1.2, 0.2], [1.2, 1.1, 0.9]])  # beside both insides: the nearest facet decides
    assert gaps(nearer, steps).gap == pytest.approx([0.2, -0.1], abs=1e-14)


def test_a_cube_falls_on_a_floor_in_space():
    """On the triangles of a plate, its corners over their insides, edges and corners."""
    plate = np.array([[-1.0, -1.0, -1.0], [2.0, -1.0, -1.0], [2.0, 2.0, -1.0], [-1.0, 2.0, -1.0]])
    floor = Obstacle("floor", plate, np.array([[0, 1, 2], [0, 2, 3]]))
    body = cube(Inertia(2.0, np.array([0.5, 0.5, 0.5]), np.eye(3) / 3.0), gravity=(0.0, 0.0, -10.0))
    bodies = field(body, contact=RigidContact([body], [RigidPair(0, floor)]))
    for t, _ in march(bodies, 1.0, 50):
        assert bodies.displacement()[:, 2].min() > -1.0 - 1e-12
        if t < 0.44:
            assert bodies.now[0].shift[2] == pytest.approx(-5.0 * t**2, rel=1e-11)
    assert bodies.displacement() == pytest.approx(np.tile([0.0, 0.0, -1.0], (8, 1)), abs=1e-11)
    assert bodies.contact.force == pytest.approx([0.0, 0.0, 20.0, 0.0, 0.0, 0.0], rel=1e-9, abs=1e-9)


def test_an_increment_can_be_taken_back():
    bodies = field(cube(initial_spin=(0.3, 1.0, 0.1)))
    bodies.initialise(0.0, 0.1)
    bodies.begin_step(0.0, 0.1)
    before = bodies.displacement()
    bodies.update(np.array([0.1, 0.2, -0.3, 0.02, -0.01, 0.03]))
    assert np.abs(bodies.displacement() - before).min() > 0.01
    bodies.retreat(np.ones(len(bodies.bodies)))
    assert bodies.displacement() == pytest.approx(before, abs=1e-14)
