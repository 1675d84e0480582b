"""Bodies that close a channel, by touching its walls or each other: nothing flows, and they carry the pressures."""

import numpy as np
import pytest
from fluid_setup import body, field, loop, make_fluid, solve_steady, sphere, step

from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.terms.boundary.patches import Patch

H = 0.1
PLACES = [0.0, H / 3.0, 0.47 * H]
NOTHING = {"q1q1": 1e-9, "q2q1": 1e-7}  # of an open channel: 3 m/s; slits of rounding are extended from far away


def disc(x, y, radius, sides=48, phase=0.0):
    angle = phase + 2.0 * np.pi * np.arange(sides) / sides
    return np.array([x, y]) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def channel(grid, bodies, walls="no_slip", **settings):
    """A channel with the pressures 1 and -0.3 at its ends."""
    patches = [
        Patch("in", ("x-",), "traction", field(1.0, *(0.0,) * (grid.dim - 1))),
        Patch("out", ("x+",), "traction", field(0.3, *(0.0,) * (grid.dim - 1))),
        Patch("walls", ("y-", "y+", "z-", "z+")[: 2 * grid.dim - 2], walls),
    ]
    return make_fluid(grid, patches, bodies, mu=0.05, **settings)


def pushed(bodies, element="q1q1", walls="no_slip", grid=None):
    """The flow in a channel, and the velocity at its nodes."""
    grid = grid or uniform([-2, 0], [2, 1], [40, 10])
    fluid = channel(grid, bodies, walls, element=element, scheme="steady")
    solve_steady(fluid)
    return fluid, np.abs(fluid.velocity()).max()


@pytest.mark.parametrize("walls", ["no_slip", "slip"])
@pytest.mark.parametrize("radius", [0.5, 0.5 - 1e-13, 0.5 + 1e-13, 0.501, 0.53])
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_cylinder_between_walls(element, place, radius, walls):
    """Its corners touch the walls in a plane of the grid or between them, or it is a little too large."""
    fluid, speed = pushed([body("c", disc(place, 0.5, radius), loop(48))], element, walls)
    assert speed < NOTHING[element]
    assert fluid.force()["c"].sum(axis=0) == pytest.approx([1.3, 0.0], abs=1e-8)


@pytest.mark.parametrize("phase", [0.0, np.pi / 48])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_two_cylinders_that_touch(element, phase):
    """Corner to corner, or side to side, and to the walls."""
    radius = 0.25 / np.cos(phase)
    bodies = [body(name, disc(0.03, y, radius, 48, phase), loop(48)) for name, y in (("a", 0.25), ("b", 0.75))]
    fluid, speed = pushed(bodies, element)
    assert speed < NOTHING[element]
    assert sum(force.sum(axis=0) for force in fluid.force().values()) == pytest.approx([1.3, 0.0], abs=1e-8)


def test_what_leaves_a_way_has_no_cells_of_its_own():
    """A cylinder at one wall, and one that leaves 0.4 cells at both."""
    for y, radius in ((0.3, 0.3), (0.5, 0.46)):
        fluid, speed = pushed([body("c", disc(0.02, y, radius), loop(48))])
        assert speed > 1e-3
        assert fluid.grid.sheets is None


@pytest.mark.parametrize("place", [0.0, H / 3.0])
def test_sphere_in_a_square_duct(place):
    """It touches all four walls: the corners are open, and unknowns are those of the box."""
    points, facets = sphere((place, 0.5, 0.5), 1.0, 2)
    points = (points - [place, 0.5, 0.5]) * (0.5 / np.abs(points[:, 1] - 0.5).max()) + [place, 0.5, 0.5]
    fluid, speed = pushed([body("s", points, facets)], grid=uniform([-1, 0, 0], [1, 1, 1], [12, 6, 6]))
    assert speed > 1e-3
    assert fluid.grid.sheets is None


@pytest.mark.parametrize(("radius", "place"), [(0.5, 0.0), (0.52, 0.0), (0.52, H / 3.0)])
def test_cylinder_across_a_duct(radius, place):
    """It closes the duct along its whole length."""
    line = disc(place, 0.5, radius, 24)
    ends = [np.column_stack([line, np.full(24, z)]) for z in (-0.1, 1.1)]
    ring, top = loop(24), np.array([[0, k, k + 1] for k in range(1, 23)])
    a, b = ring.T
    side = np.concatenate([np.stack([a, b, 24 + b], axis=1), np.stack([a, 24 + b, 24 + a], axis=1)])
    facets = np.concatenate([side, top + 24, top[:, ::-1]])
    fluid, speed = pushed([body("c", np.concatenate(ends), facets)], grid=uniform([-1, 0, 0], [1, 1, 1], [12, 6, 6]))
    assert speed < 1e-9
    assert fluid.force()["c"].sum(axis=0) == pytest.approx([1.3, 0.0, 0.0], abs=1e-8)


def rates(bodies, element, dt, steps, scheme):
    """What leaves a channel of one length in each step [m^2/s]."""
    fluid = channel(uniform([-1, 0], [1, 1], [20, 10]), bodies, element=element, scheme=scheme, dt=dt)
    out, found = flow_rate(fluid), []
    for number in range(steps):
        step(fluid, number * dt, dt)
        found.append(out(["out"]))
    return np.array(found)


@pytest.mark.parametrize(
    ("element", "scheme", "dt", "place"),
    [
        ("q1q1", "backward_euler", 0.1, PLACES[0]),
        ("q1q1", "bdf2", 0.05, PLACES[1]),
        ("q2q1", "bdf2", 0.1, PLACES[2]),
        *(pytest.param("q1q1", "backward_euler", 0.1, place, marks=pytest.mark.slow) for place in PLACES[1:]),
        *(pytest.param("q1q1", "bdf2", 0.05, place, marks=pytest.mark.slow) for place in (PLACES[0], PLACES[2])),
        *(pytest.param("q2q1", "bdf2", 0.1, place, marks=pytest.mark.slow) for place in PLACES[:2]),
    ],
)
def test_cylinder_that_slides_between_walls(element, scheme, dt, place):
    """It drives before it what it sweeps, and when it stops nothing flows: 0.18 % of an open channel did."""

    def slides(x, t):
        return x + np.array([min(t, 0.2) * 0.4, 0.0]), np.broadcast_to([0.4 * (t < 0.2 + 1e-9), 0.0], x.shape)

    moved = body("c", disc(place, 0.5, 0.5), loop(48), motion=slides)
    found = rates([moved], element, dt, round(0.4 / dt), scheme)
    assert found[0] == pytest.approx(0.4, abs=1e-6)
    assert found[-1] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("shift", [0.0, H / 3.0])
def test_two_cylinders_that_touch_and_part(shift):
    """The upper one comes down on the lower one, rests on it and goes up again."""

    def lift(t):
        return 0.08 * min(max(0.0, abs(t - 0.4) - 0.1) / 0.1, 1.0)

    def moves(x, t):
        return x + np.array([0.0, lift(t)]), np.broadcast_to([0.0, (lift(t) - lift(t - 0.1)) / 0.1], x.shape)

    lower = body("lower", disc(shift, 0.25, 0.25), loop(48))
    upper = body("upper", disc(shift, 0.8, 0.3), loop(48), motion=moves)
    found = rates([lower, upper], "q1q1", 0.1, 8, "backward_euler")
    assert found[[3, 4]] == pytest.approx(0.0, abs=1e-6)
    assert found[0] > 1e-3
    assert found[-1] > 1e-3


NESTED_CHANNEL = refined(uniform([-1.4, 0], [1.4, 1], [14, 5]), [RefinedBox([-1.1, 0.0], [1.1, 1.0], 1)])


@pytest.mark.parametrize("place", [0.0, H / 3.0])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_cylinder_in_nested_cells(element, place):
    """It touches the walls or overlaps them; one that leaves a way is no matter."""
    for radius in (0.5, 0.55):
        fluid, speed = pushed([body("c", disc(place, 0.5, radius), loop(48))], element, grid=NESTED_CHANNEL)
        assert speed < NOTHING[element]
        assert fluid.force()["c"].sum(axis=0) == pytest.approx([1.3, 0.0], abs=1e-8)
    _, speed = pushed([body("c", disc(place, 0.5, 0.46), loop(48))], element, grid=NESTED_CHANNEL)
    assert speed > 1e-3


def test_cylinders_that_come_to_touch_in_nested_cells():
    """The upper one falls into the walls and onto the lower one, past a bystander, and then nothing flows."""

    def falls(x, t):
        way = min(t, 0.325)
        return x - [0.0, 0.4 * way], np.broadcast_to([0.0, -0.4 * (way - min(t - 0.1, 0.325)) / 0.1], x.shape)

    bodies = [
        body("lower", disc(0.03, 0.25, 0.25), loop(48)),
        body("upper", disc(0.03, 0.93, 0.3), loop(48), motion=falls),
    ]
    fluid = channel(NESTED_CHANNEL, bodies, element="q1q1", scheme="backward_euler", dt=0.1)
    out, found = flow_rate(fluid), []
    for number in range(5):
        step(fluid, number * 0.1, 0.1)
        found.append(out(["out"]))
    assert found[0] > 1e-3
    assert found[-1] == pytest.approx(0.0, abs=1e-6)
