"""The largest and least speed and pressure in a box of the fluid, and their places: linear fields, known corners."""

from itertools import product

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, wall
from programs import on_processes

from solvers.fluid.flow.box_extremes import box_extreme
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined

ELEMENTS = pytest.mark.parametrize("element", ["q1q1", "q2q1"])
SLOPES = np.array([[0.3, -1.0, 0.7], [0.4, 0.5, -0.2], [1.1, 0.6, -0.8]])
SLOPE = np.array([0.7, -0.4, 0.3])  #: of the pressure


def fluid_of(grid, bodies, element, still, size=1.0):
    """A flow with linear pressure, and linear velocity that vanishes at a point."""
    dim = grid.dim
    fluid = make_fluid(grid, [wall(field(*[0.0] * dim))], bodies, element=element, scheme="steady")
    nodes, pressure = fluid.unknowns.velocity, fluid.unknowns.pressure
    fluid.flow[nodes.dofs] = (nodes.points - still) @ SLOPES[:dim, :dim].T / size
    fluid.flow[pressure.dofs[:, 0]] = pressure.points @ SLOPE[:dim] / size
    return fluid


def corners_of(polygon, low, high):
    """Corners of the part of a box that is not in a convex polygon, which is given counterclockwise."""
    ends, ways = polygon, np.roll(polygon, -1, axis=0) - polygon

    def outside(x):
        side = ways[:, 0] * (x[1] - ends[:, 1]) - ways[:, 1] * (x[0] - ends[:, 0])
        return side.min() < 1e-12

    found = [np.array(x) for x in product(*zip(low, high, strict=True)) if outside(x)]
    found += [x for x in polygon if (low <= x).all() and (x <= high).all()]
    for (x, way), axis, end in product(zip(ends, ways, strict=True), range(2), (low, high)):
        if way[axis] == 0.0:
            continue
        s = (end[axis] - x[axis]) / way[axis]
        at = x + s * way
        if 0 <= s <= 1 and low[1 - axis] <= at[1 - axis] <= high[1 - axis]:
            found.append(at)
    return np.array(found)


def check(fluid, low, high, corners, still, size=1.0):
    dim = fluid.dim
    speeds = np.linalg.norm((corners - still) @ SLOPES[:dim, :dim].T, axis=1) / size
    pressures = corners @ SLOPE[:dim] / size
    for quantity, which, values in (
        ("pressure", "largest", pressures),
        ("pressure", "least", pressures),
        ("speed", "largest", speeds),
    ):
        found = box_extreme(fluid, quantity, which, low, high)()
        best = int(values.argmax() if which == "largest" else values.argmin())
        assert found[""] == pytest.approx(values[best], rel=1e-9), (quantity, which)
        place = [found[f"place.{axis}"] for axis in "xyz"[:dim]]
        assert place == pytest.approx(corners[best], abs=1e-9 * size)


@ELEMENTS
@pytest.mark.parametrize("shift", [0.0, 1 / 15])
@pytest.mark.parametrize("nested", [False, True])
@pytest.mark.parametrize("size", [1.0, 1e-3])
def test_beside_a_polygon(element, shift, nested, size):
    """A box across a heptagon, in planes of the grid or not, moved by a third of a cell, and far smaller."""
    grid = uniform([0, 0], [size, size], [5, 5])
    grid = refined(grid, [RefinedBox([0.0, 0.0], [size, 0.75 * size], 2)]) if nested else grid
    points, still = size * circle((0.52, 0.47), 0.13, 7), size * np.array([0.3, 0.7])
    fluid = fluid_of(grid, [body("heptagon", points, loop(7))], element, still, size)
    for low, high in (([0.2 + shift, 0.4], [0.55, 0.8 + shift]), ([0.2, 0.1], [0.9, 0.95]), ([0.4, 0.3], [0.5, 0.41])):
        low, high = size * np.array(low), size * np.array(high)
        check(fluid, low, high, corners_of(points, low, high), still, size)


@ELEMENTS
def test_in_space(element):
    """A box of which a block takes two corners."""
    points, facets = block([0.45, 0.4, -0.1], [0.7, 1.1, 0.55])
    still = np.array([0.2, 0.3, 0.8])
    fluid = fluid_of(uniform([0] * 3, [1] * 3, [4] * 3), [body("block", points, facets)], element, still)
    low, high = np.array([0.1, 0.1, 0.3]), np.array([0.6, 0.85, 0.9])
    corners = [x for x in product(*zip(low, high, strict=True)) if not (x[0] > 0.45 and x[1] > 0.4 and x[2] < 0.55)]
    corners += [(0.45, y, z) for y in (0.4, 0.85) for z in (0.3, 0.55)]
    corners += [(0.6, 0.4, 0.3), (0.6, 0.4, 0.55), (0.6, 0.85, 0.55)]
    check(fluid, low, high, np.array(corners), still)


@ELEMENTS
def test_least_speed_between_points(element):
    """The flow stands still at one point: in a cell, in a cut cell, or in a body."""
    points = circle((0.52, 0.47), 0.13, 7)
    for still in ([0.31234, 0.81817], [0.389, 0.47]):
        fluid = fluid_of(uniform([0, 0], [1, 1], [5, 5]), [body("heptagon", points, loop(7))], element, still)
        found = box_extreme(fluid, "speed", "least")()
        assert found[""] == pytest.approx(0.0, abs=2e-6)
        assert [found["place.x"], found["place.y"]] == pytest.approx(still, abs=2e-6)
    fluid = fluid_of(uniform([0, 0], [1, 1], [5, 5]), [body("heptagon", points, loop(7))], element, [0.52, 0.47])
    assert box_extreme(fluid, "speed", "least")()[""] > 0.1 * np.linalg.svd(SLOPES[:2, :2])[1].min()


@ELEMENTS
@pytest.mark.parametrize(("points", "candidates"), [(3, 32), (9, 32), (5, 8), (5, 128)])
def test_points_in_cells_do_not_matter(element, points, candidates, monkeypatch):
    """Vortices around a heptagon: the speed between nodes is that of the finest lattice around the best point."""
    fluid = fluid_of(
        uniform([0, 0], [1, 1], [9, 7]), [body("heptagon", circle((0.52, 0.47), 0.13, 7), loop(7))], element, 0
    )
    x, y = np.pi * fluid.unknowns.velocity.points.T * 2.3
    fluid.flow[fluid.unknowns.velocity.dofs] = np.stack(
        [np.sin(x) * np.cos(y) + 0.2, -np.cos(x) * np.sin(1.1 * y)], axis=1
    )
    found = [box_extreme(fluid, "speed", "largest", low, [0.9, 0.8])() for low in ([0.05, 0.1], [0.31, 0.2])]
    monkeypatch.setattr("solvers.fluid.flow.box_extremes.LATTICE", points)
    monkeypatch.setattr("solvers.fluid.flow.box_extremes.CANDIDATES", candidates)
    for one, low in zip(found, ([0.05, 0.1], [0.31, 0.2]), strict=True):
        assert box_extreme(fluid, "speed", "largest", low, [0.9, 0.8])() == pytest.approx(one, rel=1e-6)


def test_without_fluid():
    points, facets = block([0.2, 0.2], [0.8, 0.8])
    fluid = fluid_of(uniform([0, 0], [1, 1], [5, 5]), [body("block", points, facets)], "q1q1", [0.0, 0.0])
    found = box_extreme(fluid, "pressure", "largest", [0.3, 0.3], [0.7, 0.65])()
    assert np.isnan(list(found.values())).all()


@ELEMENTS
def test_sides_of_a_thin_plate(element):
    """Cells for each side of a plate: the flow is along one of them only."""
    points, facets = block([-0.1, 0.52], [1.1, 0.55])
    fluid = fluid_of(uniform([0, 0], [1, 1], [5, 6]), [body("plate", points, facets)], element, [0.0, 0.0])
    sheets, numbers = fluid.grid.sheets, fluid.grid.numbers
    assert sheets is not None
    fluid.flow[:] = 0.0
    for cell in [*fluid.cut.uncut, *fluid.cut.cut]:
        row = numbers[cell] // 5
        top = sheets.cell_at(int(numbers[cell]), np.array([0.5, 0.95])) == fluid.grid.in_sheets[cell]
        if row > 3 or (row == 3 and top):
            fluid.flow[fluid.unknowns.cell_velocity[cell].reshape(-1, 2)[:, 0]] = 1.0
    low, high = [0.1, 0.0], [0.9, 0.52]
    assert box_extreme(fluid, "speed", "largest", low, high)()[""] == pytest.approx(0.0, abs=1e-12)
    low, high = [0.1, 0.55], [0.9, 1.0]
    assert box_extreme(fluid, "speed", "least", low, high)()[""] == pytest.approx(1.0, rel=1e-12)


def test_on_two_processes():
    on_processes(2, __file__)


if __name__ == "__main__":
    test_beside_a_polygon("q2q1", 1 / 15, True, 1.0)
    test_in_space("q1q1")
    test_without_fluid()
