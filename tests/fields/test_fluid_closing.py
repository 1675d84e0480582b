"""Bodies that close a channel, by touching its walls or each other: nothing flows, and they carry the pressures."""

import numpy as np
import pytest
from fluid_setup import body, field, loop, make_fluid, solve_steady, sphere

from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

H = 0.1
PLACES = [0.0, H / 3.0, 0.47 * H]
NOTHING = {"q1q1": 1e-9, "q2q1": 1e-7}  # of an open channel: 3 m/s; slits of rounding are extended from far away


def disc(x, y, radius, sides=48, phase=0.0):
    angle = phase + 2.0 * np.pi * np.arange(sides) / sides
    return np.array([x, y]) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def pushed(bodies, element="q1q1", walls="no_slip", grid=None):
    """The flow in a channel with the pressures 1 and -0.3 at its ends, and the velocity at its nodes."""
    grid = grid or uniform([-2, 0], [2, 1], [40, 10])
    patches = [
        Patch("in", ("x-",), "traction", field(1.0, *(0.0,) * (grid.dim - 1))),
        Patch("out", ("x+",), "traction", field(0.3, *(0.0,) * (grid.dim - 1))),
        Patch("walls", ("y-", "y+", "z-", "z+")[: 2 * grid.dim - 2], walls),
    ]
    fluid = make_fluid(grid, patches, bodies, element=element, scheme="steady", mu=0.05)
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
