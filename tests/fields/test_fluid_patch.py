"""Flows that lie in the discrete space are reproduced to round-off, at any cut and while the cut moves."""

import numpy as np
import pytest
from fluid_setup import (
    block,
    body,
    circle,
    enclosed,
    field,
    loop,
    make_fluid,
    nodal_errors,
    solve_steady,
    sphere,
    step,
    turned,
    wall,
)

from solvers.fluid.grid.box import Grid, uniform

ELEMENTS = ("q1q1", "q2q1")
SCHEMES = ("steady", "backward_euler", "bdf2")


def shear(dim):
    """u = (5 + 30 y + 60 z, 0, 0), p = -1 + 10 x, which a force (10, 0, 0) holds."""
    if dim == 2:
        return field(lambda x, y, t: 5 + 30 * y, 0), field(10, 0)
    return field(lambda x, y, z, t: 5 + 30 * y + 60 * z, 0, 0), field(10, 0, 0)


def pressure(x, t):
    return 10.0 * x[0] - 1.0


def cutting_plane(dim, x, angle, velocity, speed):
    """A large block right of a plane through (x, 0, 0) that moves at `speed`; its surface has the flow's velocity."""
    low, high = ([0, -3], [3, 3]) if dim == 2 else ([0, -3, -3], [3, 3, 3])
    points, facets = block(low, high)
    points = turned(points, angle)
    if dim == 3:
        points = turned(points[:, [2, 0, 1]], angle / 2)[:, [1, 2, 0]]
    points[:, 0] += x
    shift = np.eye(dim)[0] * speed

    def motion(points, t):
        now = points + shift * t
        return now, np.stack([c(now.T, t) for c in velocity], axis=1)

    rests = motion(points, 0.0)[1] if speed == 0 else 0.0
    return body("plane", points, facets, motion=None if speed == 0 else motion, velocity=rests)


def channel(dim):
    return uniform([-0.5, -0.05, -0.05][:dim], [0.5, 0.05, 0.05][:dim], [10, 3, 3][:dim])


def shear_errors(dim, element, scheme, x, angle, speed, steps=3, dt=0.01):
    velocity, force = shear(dim)
    plane = cutting_plane(dim, x, angle, velocity, speed)
    settings = {"rho": 1.0, "mu": 0.1, "element": element, "scheme": scheme, "body_force": force}
    fluid = make_fluid(channel(dim), [wall(velocity)], [plane], dt=dt, initial_velocity=velocity, **settings)
    worst = np.zeros(2)
    for number in range(steps):
        step(fluid, number * dt, dt)
        errors = nodal_errors(fluid, velocity, pressure, (number + 1) * dt, level=True)
        worst = np.maximum(worst, errors)
    return worst, fluid


@pytest.mark.parametrize("speed", [0.0, -0.038, 3.0, -4.0])
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("element", ELEMENTS)
def test_shear_flow_cut_by_a_plane_2d(element, scheme, speed):
    worst, fluid = shear_errors(2, element, scheme, 0.123, 0.3, speed, steps=5)
    assert len(fluid.cut.cut) > 2
    assert worst.max() < 1e-10


@pytest.mark.parametrize(("scheme", "speed"), [("steady", 0.0), ("backward_euler", -3.0), ("bdf2", 3.0)])
def test_shear_flow_cut_by_a_plane_3d(scheme, speed):
    worst, _ = shear_errors(3, "q1q1", scheme, 0.123, 0.3, speed)
    assert worst.max() < 1e-10


@pytest.mark.slow
def test_shear_flow_cut_by_a_plane_3d_second_order():
    worst, _ = shear_errors(3, "q2q1", "bdf2", 0.123, 0.3, 3.0)
    assert worst.max() < 1e-10


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("side", [-1, 1])
def test_slivers_2d(element, side):
    for exponent in range(1, 13):
        worst, fluid = shear_errors(2, element, "bdf2", 0.1 + side * 0.1 * 10.0**-exponent, 0.0, 0.0, steps=2)
        smallest = fluid.cut.fraction[fluid.cut.cut].min(initial=1.0)
        assert exponent > 9 or smallest == pytest.approx(0.1**exponent if side > 0 else 1 - 0.1**exponent, rel=1e-5)
        assert worst.max() < 1e-10, (exponent, worst)


def test_slivers_3d():
    for exponent in (3, 6, 9, 12):
        worst, _ = shear_errors(3, "q1q1", "backward_euler", 0.1 + 0.1 * 10.0**-exponent, 0.0, 0.0, steps=1)
        assert worst.max() < 1e-10, exponent


@pytest.mark.parametrize(("dim", "element"), [(2, "q1q1"), (2, "q2q1"), (3, "q1q1")])
def test_uniform_flow_through_a_moving_cut(dim, element):
    velocity = field(*[5, 0, 0][:dim])
    plane = cutting_plane(dim, 0.2, 0.4, velocity, -3.0)
    fluid = make_fluid(
        channel(dim), [wall(velocity)], [plane], mu=0.1, element=element, dt=0.01, initial_velocity=velocity
    )
    for number in range(5):
        step(fluid, 0.01 * number, 0.01)
        errors = nodal_errors(fluid, velocity, lambda x, t: 0.0 * x[0], 0.0, level=True)
        assert max(errors) < 1e-10


@pytest.mark.parametrize("scheme", ["steady", "bdf2"])
@pytest.mark.parametrize("dim", [2, 3])
def test_hydrostatic(dim, scheme):
    """A closed box of water at rest under gravity: no flow, exact pressure, and the buoyancy of Archimedes.

    The velocity's round-off is measured by the flow that the weight would drive if nothing balanced it.
    """
    rho, mu, g, dt, n = 1000.0, 1e-3, 9.81, 0.1, {2: 11, 3: 7}[dim]
    still = field(*[0] * dim)
    if dim == 2:
        points, facets = circle((0.47, 0.53), 0.27, 80), loop(80)
    else:
        points, facets = sphere((0.47, 0.53, 0.51), 0.27, 3)
    weight = field(*[0] * (dim - 1), -rho * g)
    disc = body("disc", points, facets)
    fluid = make_fluid(
        uniform([0] * dim, [1] * dim, [n] * dim), [wall(still)], [disc],
        rho=rho, mu=mu, scheme=scheme, body_force=weight, dt=dt,
    )  # fmt: skip
    for number in range(2):
        step(fluid, dt * number, dt)
    u, p = nodal_errors(fluid, still, lambda x, t: -rho * g * x[dim - 1], 0.0, level=True)
    assert u < 1e-12 * (rho * g / mu if scheme == "steady" else g * dt)
    assert p < 1e-12 * rho * g
    force = fluid.force()["disc"].sum(axis=0)
    buoyancy = rho * g * enclosed(points, facets)
    assert force[-1] == pytest.approx(buoyancy, rel=1e-12)
    assert np.abs(force[:-1]).max() < 1e-12 * buoyancy


@pytest.mark.parametrize("scheme", ["backward_euler", "bdf2"])
@pytest.mark.parametrize("element", ELEMENTS)
def test_body_that_moves_with_the_flow_does_not_disturb_it_2d(element, scheme):
    points, facets = circle((0.3, 0.4), 0.16, 50), loop(50)
    changes = galilean(2, element, scheme, points, facets, 12, 20)
    assert changes > 10


def test_body_that_moves_with_the_flow_does_not_disturb_it_3d():
    points, facets = sphere((0.35, 0.45, 0.5), 0.21, 2)
    changes = galilean(3, "q1q1", "bdf2", points, facets, 6, 6)
    assert changes > 2


def galilean(dim, element, scheme, points, facets, cells, steps, dt=0.05):
    """Number of steps in which the set of cut cells changed."""
    U = np.array([0.4, 0.15, 0.1])[:dim]
    velocity = field(*U)
    mover = body("mover", points, facets, motion=lambda x, t: (x + t * U, 0 * x + U))
    fluid = make_fluid(
        uniform([0] * dim, [1] * dim, [cells] * dim), [wall(velocity)], [mover],
        mu=0.01, element=element, scheme=scheme, dt=dt, initial_velocity=velocity,
    )  # fmt: skip
    before, changes = fluid.cut.cut, 0
    for number in range(steps):
        step(fluid, dt * number, dt)
        changes += not np.array_equal(before, fluid.cut.cut)
        before = fluid.cut.cut
        errors = nodal_errors(fluid, velocity, lambda x, t: 0.0 * x[0], 0.0, level=True)
        assert max(errors) < 1e-10
        assert np.abs(fluid.force()["mover"].sum(axis=0)).max() < 1e-10
    return changes


@pytest.mark.parametrize("element", ELEMENTS)
def test_graded_grid(element):
    """Cells of different size, the cut through the finest."""
    velocity, force = shear(2)
    x = np.concatenate([np.linspace(-0.5, 0, 4), [0.03, 0.06, 0.1, 0.15, 0.25, 0.5]])
    y = np.array([-0.05, -0.03, 0.01, 0.05])
    plane = cutting_plane(2, 0.05, 0.5, velocity, 2.0)
    fluid = make_fluid(
        Grid((x, y)), [wall(velocity)], [plane],
        mu=0.1, element=element, body_force=force, initial_velocity=velocity, dt=0.01,
    )  # fmt: skip
    for number in range(3):
        step(fluid, 0.01 * number, 0.01)
        assert max(nodal_errors(fluid, velocity, pressure, 0.0, level=True)) < 1e-10


def test_traction_and_slip_faces():
    """Couette flow between a slip face and nothing: p = 10 x - 1 held by tractions, u = 2 y dragged by the lid."""
    from solvers.fluid.terms.boundary.patches import Patch

    mu = 0.1
    velocity = field(lambda x, y, t: 2 * y, 0)

    def side(sign):
        return field(lambda x, y, t: -sign * (10 * x - 1), lambda x, y, t: sign * mu * 2.0)

    patches = [
        Patch("left", ("x-",), "traction", side(-1)),
        Patch("right", ("x+",), "traction", side(1)),
        Patch("plates", ("y-", "y+"), "velocity", velocity),
    ]
    points, facets = block([0.31, -0.32], [0.62, 0.21])
    points = turned(points, 0.3, (0.45, 0.0))
    fixed = body("block", points, facets, velocity=np.stack([2 * points[:, 1], 0 * points[:, 0]], axis=1))
    fluid = make_fluid(
        uniform([0, -0.5], [1, 0.5], [9, 9]), patches, [fixed], mu=mu, scheme="steady", body_force=field(10, 0)
    )
    solve_steady(fluid)
    u, p = nodal_errors(fluid, velocity, pressure, 0.0)
    assert max(u, p) < 1e-10
