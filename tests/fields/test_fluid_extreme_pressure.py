"""The largest and the least pressure are those of the fluid: linear fields on fluid whose corners are known."""

import numpy as np
import pytest
from fluid_setup import block, body, field, loop, make_fluid, turned, wall
from lubrication import approaching

from solvers.fluid.flow.extreme_pressure import clipped, extreme_pressure
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined

ELEMENTS = pytest.mark.parametrize("element", ["q1q1", "q2q1"])
NOTCH = np.array([[2.0, -1.0], [2.0, 2.0], [0.3, 1.3], [0.73, 0.41], [0.3, -0.3]])  #: of the solid, its tip in a cell


def with_pressure(grid, bodies, pressure, element):
    """A flow at rest whose pressure has the values of a function at all nodes, also behind surfaces."""
    fluid = make_fluid(grid, [wall(field(*[0.0] * grid.dim))], bodies, element=element)
    nodes = fluid.unknowns.pressure
    fluid.flow[nodes.dofs.ravel()] = pressure(nodes.points.T)
    return fluid


def extremes(fluid):
    return tuple(extreme_pressure(fluid, which)()[""] for which in ("largest", "least"))


@ELEMENTS
def test_without_bodies(element):
    fluid = with_pressure(uniform([0, 0], [1, 2], [4, 4]), [], lambda x: 3.0 - 2.0 * x[0] + x[1], element)
    assert extremes(fluid) == pytest.approx((5.0, 1.0), abs=1e-12)


@ELEMENTS
def test_at_the_tip_of_a_notch(element):
    """The tip is in the middle of a cell, whose nodes to its right have larger values."""
    solid = body("solid", NOTCH, loop(len(NOTCH)))
    for sign in (1.0, -1.0):
        fluid = with_pressure(uniform([0, 0], [1, 1], [7, 9]), [solid], lambda x, sign=sign: sign * x[0], element)
        assert extremes(fluid) == pytest.approx(sorted((0.73 * sign, 0.0), reverse=True), abs=1e-9)


def test_in_nested_cells():
    solid = body("solid", NOTCH, loop(len(NOTCH)))
    grid = refined(uniform([-2, 0], [1, 1], [12, 4]), [RefinedBox([-0.75, 0], [1, 1], 1)])
    fluid = with_pressure(grid, [solid], lambda x: x[0], "q1q1")
    assert extremes(fluid) == pytest.approx((0.73, -2.0), abs=1e-9)


@ELEMENTS
def test_in_a_film(element):
    """All nodes above a film of 0.3 cells are behind its wall; the fluid has none of their values."""
    points, facets = block([-1.0, 0.03], [2.0, 1.7])
    fluid = with_pressure(uniform([0, 0], [1, 1], [10, 10]), [body("plate", points, facets)], lambda x: x[1], element)
    assert extremes(fluid)[0] == pytest.approx(0.03, abs=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_below_a_wall_in_space(angle):
    """A pressure that grows along the normal of a wall is largest on it; below a wall that is turned, in the corner."""
    points, facets = block([0.62, -3.0, -3.0], [4.0, 3.0, 3.0])
    wall_at = body("wall", turned(points, angle), facets)
    normal = np.array([np.cos(angle), np.sin(angle), 0.0])
    grid = uniform([0, 0, 0], [1, 1, 1], [3, 4, 2])
    fluid = with_pressure(grid, [wall_at], lambda x: normal @ x, "q1q1")
    assert extremes(fluid) == pytest.approx((0.62, 0.0), abs=1e-9)
    fluid = with_pressure(grid, [wall_at], lambda x: x[0], "q1q1")
    assert extremes(fluid) == pytest.approx((0.62 / np.cos(angle), 0.0), abs=1e-9)


@pytest.mark.parametrize(("gap", "bound"), [(0.05, 0.12), (0.02, 0.05)])
def test_in_the_film_of_a_rough_cylinder(gap, bound):
    """The largest pressure is that of the film equation, up to its own error of the order of the gap over the radius.

    T p' = -mu V x with T = g^3 / 12 + kappa and g = gap + x^2 / 2 for the radius 1. On one cell across the gap a node
    in the cylinder has 1.29 times this pressure.
    """
    kappa, x = 0.05**3 / 12.0, np.linspace(0.0, 3.0, 30001)
    slope = x / ((gap + x**2 / 2.0) ** 3 / 12.0 + kappa)
    film = float(slope.sum() * x[1])  # the trapezoidal rule: the ends have nothing to speak of
    fluid = approaching(2, gap, 0.05, "q1q1", transmissivity=kappa, narrow_gaps=True)
    assert extremes(fluid)[0] == pytest.approx(film, rel=bound)


def test_parts_of_facets_in_a_cell():
    """Corners of a segment and of a triangle in the unit cell; none outside of it."""
    along = clipped(np.array([[-0.5, 0.0], [1.5, 1.0]]))
    assert {tuple(np.round(x, 12)) for x in along} == {(0.0, 0.25), (1.0, 0.75)}
    across = clipped(np.array([[0.5, -1.0, 0.5], [0.5, 3.0, 0.5], [0.5, -1.0, 4.5]]))
    assert {tuple(np.round(x, 12)) for x in across} == {(0.5, y, z) for y in (0.0, 1.0) for z in (0.5, 1.0)}
    assert len(clipped(np.array([[1.2, 0.0], [1.1, 1.0]]))) == 0
