"""Walls with a slip length: the shear stress is mu / b times the velocity along them."""

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, nodal_errors, solve_steady

from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

MU, SLIP = 0.7, 0.3


def slope(y):
    """Velocity at a height above a wall at rest, 1 at y = 1."""
    return (y + SLIP) / (1.0 + SLIP)


def shear(patches, bodies=(), **settings):
    grid = uniform([0, 0], [1, 1], [5, 4])
    settings = {"scheme": "steady", "convection": False, "mu": MU} | settings
    fluid = make_fluid(grid, patches, bodies, **settings)
    solve_steady(fluid)
    return fluid


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("convection", [False, True])
def test_shear_flow(element, convection):
    """It sticks to a wall that is a slip length farther away."""
    u = field(lambda x, y, t: slope(y), 0)
    patches = [Patch("rest", ("x-", "x+", "y+"), "velocity", u), Patch("wall", ("y-",), "slip_length", field(SLIP))]
    fluid = shear(patches, element=element, convection=convection)
    assert nodal_errors(fluid, u, field(0)[0], 0.0, level=True)[0] < 1e-9


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_wall_that_a_body_covers_in_part(element):
    """The body moves with the flow, so that it is not noticed, but for the slip below it."""
    u = field(lambda x, y, t: slope(y), 0)
    patches = [Patch("rest", ("x-", "x+", "y+"), "velocity", u), Patch("wall", ("y-",), "slip_length", field(SLIP))]
    moves = body(
        "brick",
        *block([0.33, -0.2], [0.71, 0.47]),
        motion=lambda x, t: (x, np.stack([slope(x[:, 1]), 0 * x[:, 1]], axis=1)),
    )
    fluid = shear(patches, [moves], element=element)
    used = fluid.system.active_dofs
    velocity = fluid.unknowns.velocity
    nodes = used[velocity.dofs[:, 0]]
    assert fluid.flow[velocity.dofs[nodes, 0]] == pytest.approx(slope(velocity.points[nodes, 1]), abs=1e-8)
