"""Flow through a gap between two bodies, down to a fraction of a cell: Q = g^3 f / (12 mu)."""

import numpy as np
import pytest
from fluid_setup import block, body, field, fluid_rule, make_fluid, solve_steady, values
from test_fluid_arrays import hold_tangential

from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

MU, FORCE = 0.7, 3.0


def flow_ratio(gap, element, place, *, cells=12):
    """Q / Q_exact for a gap (in cells) that begins at a share `place` of a cell above a plane of the grid."""
    h = 1.0 / cells
    low = (2 + place) * h
    bodies = [body("lower", *block([-1, -1], [2, low])), body("upper", *block([-1, low + gap * h], [2, 2]))]
    patches = [Patch("ends", ("x-", "x+"), "traction", field(0, 0)), Patch("walls", ("y-", "y+"), "no_slip")]
    fluid = make_fluid(
        uniform([0, 0], [4 * h, 1], [4, cells]), patches, bodies, mu=MU, element=element, scheme="steady",
        convection=False, body_force=field(FORCE, 0),
    )  # fmt: skip
    hold_tangential(fluid, (0,))
    solve_steady(fluid)
    force = sum(f.sum(axis=0) for f in fluid.force().values())
    assert force[0] == pytest.approx(FORCE * gap * h * 4 * h, rel=1e-9)
    return flow(fluid) / (FORCE * (gap * h) ** 3 / (12 * MU))


def flow(fluid):
    """Mean over the length of the flow through the fluid part of all cross-sections."""
    rule = fluid_rule(fluid)
    u = values(fluid, rule)[0]
    length = fluid.grid.grid.edges[0][-1]
    return float((rule.weights * u[..., 0]).sum()) / length


PLACES = (0.0, 0.13, 0.31, 0.5, 0.77, 0.99)


def test_second_order_is_exact_at_any_width():
    """The parabola lies in the space: exact, with both walls in one row of cells too."""
    for gap in (4, 2, 1, 0.5, 0.25, 0.1):
        ratios = np.array([flow_ratio(gap, "q2q1", place) for place in PLACES])
        assert np.abs(ratios - 1).max() < 1e-7, (gap, ratios)


@pytest.mark.parametrize(("gap", "low", "high"), [(8, 0.97, 1), (4, 0.9, 1), (2, 0.6, 1), (1, 0.1, 1), (0.5, 0.2, 1)])
def test_first_order_resists_too_much(gap, low, high):
    """Known and documented: with few cells across, too little flows."""
    ratios = np.array([flow_ratio(gap, "q1q1", place) for place in PLACES])
    assert np.all((low < ratios) & (ratios < high)), ratios
