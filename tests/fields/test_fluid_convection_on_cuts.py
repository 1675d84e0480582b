"""Products of three velocities of second degree, as in the convective term, over cut cells in 2D."""

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, wall

from solvers.fluid.grid.box import uniform
from solvers.mesh.gauss import gauss


def over_polygon(x, f_of_x):
    """int f dA by Green's theorem; f_of_x: the integral of f along x."""
    s, w = gauss(8)
    total = 0.0
    for a, b in zip(x, np.roll(x, -1, axis=0), strict=True):
        at = a + s[:, None] * (b - a)
        total += (b - a)[1] * float(w @ f_of_x(*at.T))
    return total


@pytest.mark.parametrize("powers", [(2, 6), (6, 2), (5, 6), (6, 6)])
def test_of_second_degree(powers):
    """Degree six in each direction. With five points in each direction 1e-6 is missing."""
    i, j = powers
    points = circle((0.52, 0.47), 0.23, 7)
    disc = body("disc", points, loop(7))
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [3, 3]), [wall(field(0.0, 0.0))], [disc], element="q2q1", scheme="steady"
    )
    fluid.begin_step(0.0, 1.0)
    cut, rule, grid = fluid.system.cut, fluid.system.weights, fluid.grid
    total = 0.0
    for cells, share in ((cut.cut, cut.fluid[:, rule.order]), (cut.uncut, np.ones((len(cut.uncut), len(rule.order))))):
        x = grid.origins(cells)[:, None] + rule.reference * grid.sizes[cells][:, None]
        total += float(
            (share * rule.rule * grid.sizes[cells].prod(axis=1)[:, None] * x[..., 0] ** i * x[..., 1] ** j).sum()
        )
    inside = over_polygon(points, lambda x, y: x ** (i + 1) / (i + 1) * y**j)
    assert total == pytest.approx(1.0 / (i + 1) / (j + 1) - inside, rel=1e-12)
