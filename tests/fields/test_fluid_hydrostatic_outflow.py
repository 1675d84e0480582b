"""Outflow through a face along gravity: fluid at rest stays at rest, and a flow is that without gravity."""

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, step

from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.terms.boundary.patches import Patch

FORCE = (0.4, -3.0, 0.7)  # [N/m^3], also across the outlet


def flow(dim, element, inflow=0.0, force=FORCE, bodies=(), grid=None):
    """After two steps, with a vertical outlet at x+ and walls around."""
    sides = ("y-", "y+", "z-", "z+")[: 2 * dim - 2]
    profile = lambda x, y, *zt: inflow * y * (1.0 - y)  # noqa: E731
    patches = [
        Patch("in", ("x-",), "velocity", field(*[profile, 0.0, 0.0][:dim])),
        Patch("out", ("x+",), "outflow"),
        Patch("walls", sides, "slip"),
    ]
    grid = grid or uniform([0] * dim, [2, 1, 1][:dim], [6, 5, 4][:dim])
    fluid = make_fluid(grid, patches, bodies, mu=0.05, dt=0.1, element=element, body_force=field(*force[:dim]))
    for number in range(2):
        step(fluid, 0.1 * number, 0.1)
    return fluid


def hydrostatic(fluid, x_out=2.0):
    """b . (x - x_0), x_0: the middle of the outlet."""
    x, dim = fluid.unknowns.pressure.points, fluid.dim
    return (x - np.array([x_out, 0.5, 0.5][:dim])) @ np.array(FORCE[:dim])


def pressure(fluid):
    return fluid.flow[fluid.unknowns.pressure.dofs[:, 0]]


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("dim", [2, 3])
def test_rest(dim, element):
    fluid = flow(dim, element)
    assert np.abs(fluid.velocity()).max() < 1e-10
    assert pressure(fluid) == pytest.approx(hydrostatic(fluid), abs=1e-9)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_rest_on_unequal_cells(element):
    fluid = flow(2, element, grid=refined(uniform([0, 0], [2, 1], [6, 5]), [RefinedBox([1, 0], [2, 0.5], 1)]))
    assert np.abs(fluid.velocity()).max() < 1e-10
    assert pressure(fluid) == pytest.approx(hydrostatic(fluid), abs=1e-9)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_rest_with_a_body_in_the_outlet(element):
    """Its part of the outlet counts in the mean, so that the level of the pressure does not change as it moves."""
    obstacle = body("obstacle", *block([1.53, 0.23], [2.4, 0.55]))
    fluid = flow(2, element, bodies=[obstacle])
    assert np.abs(fluid.velocity()).max() < 1e-9
    active = fluid.system.active_dofs[fluid.unknowns.pressure.dofs[:, 0]]
    assert pressure(fluid)[active] == pytest.approx(hydrostatic(fluid)[active], abs=1e-7)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_flow_with_and_without_gravity(element):
    heavy, light = flow(2, element, inflow=2.0), flow(2, element, inflow=2.0, force=(0.0, 0.0))
    assert np.abs(light.velocity()).max() > 0.3
    assert heavy.velocity() == pytest.approx(light.velocity(), abs=1e-8)
    assert pressure(heavy) == pytest.approx(pressure(light) + hydrostatic(heavy), abs=1e-7)
