"""Thin bodies beside planes of the grid, and nearly parallel to them: nothing leaks, and the surface closes."""

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, solve_steady, turned

from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.terms.boundary.patches import Patch

#: the cells from 1 to 1.5 are five times as long as the smallest ones
GRADED = (0.0, 0.5, 1.0, 1.5, 1.6, 1.7, 1.8, 1.9, 2.0, 2.5, 3.0)


def closed(grid, plate, element="q1q1"):
    """A channel with slip walls and a plate across it, 2 Pa on the left and 0.7 Pa on the right."""
    patches = [
        Patch("left", ("x-",), "traction", field(2.0, 0.0)),
        Patch("right", ("x+",), "traction", field(-0.7, 0.0)),
        Patch("sides", ("y-", "y+"), "slip"),
    ]
    fluid = make_fluid(grid, patches, [body("plate", *plate)], element=element, scheme="steady", convection=False)
    solve_steady(fluid)
    return fluid


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("slivers", [(1.2e-11, 1.2e-11), (4e-11, 4e-11), (0.0, 9e-11), (1.2e-10, 1.2e-10)], ids=str)
def test_plate_that_fills_a_cell_but_for_a_sliver(slivers, element):
    """The sliver, its thickness given below and above, has less fluid than the cut sees, but for the last one."""
    points, facets = block([0.93, -0.4], [1.5, 1.4])
    points[points[:, 0] > 1.0, 0] -= np.where(points[points[:, 0] > 1.0, 1] < 0.5, *slivers)
    fluid = closed(Grid((np.array(GRADED), np.linspace(0.0, 1.0, 5))), (points, facets), element)
    assert np.abs(fluid.flow[fluid.unknowns.velocity.dofs]).max() < 1e-9
    assert fluid.force()["plate"].sum(axis=0) == pytest.approx([1.3, 0.0], abs=1e-8)


@pytest.mark.parametrize("angle", [1e-3, 1e-2, 1e-1])
def test_surface_nearly_in_planes_of_the_grid_closes(angle):
    """Its pieces have common ends to the last bit: only their sum is rounded."""
    points, facets = block([-1.13, -0.015], [1.13, 0.015])
    points = turned(points, angle) + np.array([1.5, 0.512])
    pieces = closed(uniform([0, 0], [3, 1], [30, 10]), (points, facets)).cut.pieces
    lengths = pieces.moments.sum(axis=(1, 2))
    assert np.abs(lengths @ pieces.normal).max() < np.finfo(float).eps * lengths.sum()
