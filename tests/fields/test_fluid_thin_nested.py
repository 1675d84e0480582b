"""Thin bodies in nested cells: the fluid on one side does not know of that on the other."""

import numpy as np
import pytest
from fluid_setup import block, body, field, fluid_rule, make_fluid, solve_steady, turned, values

from solvers.fluid.flow.probes import at_point
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.terms.boundary.patches import Patch

THICKNESSES = [1e-3, 0.2, 1.0, 1.5]  # in cells of the finest level


def channel(plate, element, pressures, levels=1):
    """A channel with slip walls, closed by a plate in finer cells, with given pressures at its ends."""
    patches = [
        Patch("in", ("x-",), "traction", field(pressures[0], 0.0)),
        Patch("out", ("x+",), "traction", field(-pressures[1], 0.0)),
        Patch("w", ("y-", "y+"), "slip"),
    ]
    grid = refined(uniform([0, 0], [3, 1], [24, 8]), [RefinedBox([0.9, 0.0], [2.1, 1.0], levels)])
    fluid = make_fluid(
        grid, patches, [body("plate", *plate)], element=element, scheme="steady", convection=False
    )  # fmt: skip
    solve_steady(fluid)
    return fluid


@pytest.mark.parametrize("thickness", THICKNESSES)
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("levels", [1, 2])
def test_plate_that_seals_a_channel(element, thickness, levels):
    """Pressures on both sides are constant; nothing flows, and the plate carries their difference."""
    pressures, size = (2.0, 0.7), 0.125 / 2**levels
    for draw in range(3):
        rng = np.random.default_rng(draw)
        angle, middle = rng.uniform(-0.3, 0.3), np.array([1.5, 0.5]) + rng.uniform(-0.06, 0.06, 2)
        points, facets = block([-thickness * size / 2, -0.9], [thickness * size / 2, 0.9])
        fluid = channel((turned(points, angle) + middle, facets), element, pressures, levels)
        force = (pressures[0] - pressures[1]) / np.cos(angle) * np.array([np.cos(angle), np.sin(angle)])
        assert np.abs(fluid.flow[fluid.unknowns.velocity.dofs]).max() < 1e-9, draw
        assert np.abs(fluid.force()["plate"].sum(axis=0) - force).max() < 1e-8, draw


def test_probes_on_both_sides():
    """Points in one cell, with a plate between them, and in coarser cells."""
    fluid = channel(block([1.53, -0.5], [1.55, 1.5]), "q1q1", (2.0, 0.5))
    for x, pressure in ((1.52, 2.0), (1.5299, 2.0), (1.5501, 0.5), (1.56, 0.5), (0.31, 2.0), (2.71, 0.5)):
        assert abs(at_point(fluid, "pressure", (x, 0.47), 0.0)()[""] - pressure) < 1e-10


@pytest.mark.parametrize("thickness", THICKNESSES)
def test_two_parabolas(thickness):
    """Both flows along a plate are exact, also in the coarser cells beside; it carries half of the force."""
    for middle in np.random.default_rng(5).uniform(0.4, 0.6, 3):
        low, high = middle - thickness * 0.05 / 2, middle + thickness * 0.05 / 2
        patches = [Patch("ends", ("x-", "x+"), "outflow"), Patch("w", ("y-", "y+"), "no_slip")]
        fluid = make_fluid(
            refined(uniform([0, 0], [1, 1], [6, 10]), [RefinedBox([0.0, 0.2], [1.0, 0.8], 1)]), patches,
            [body("plate", *block([-0.5, low], [1.5, high]))],
            element="q2q1", scheme="steady", convection=False, mu=0.3, body_force=field(2.0, 0.0),
        )  # fmt: skip
        solve_steady(fluid)
        rule = fluid_rule(fluid)
        u, _, p = values(fluid, rule)
        wet = rule.weights.sum(axis=1) > 1e-9
        y, weights = rule.x[wet, :, 1], rule.weights[wet]
        below = (y * weights).sum(axis=1) / weights.sum(axis=1) < middle
        exact = np.where(below[:, None], y * (low - y), (1.0 - y) * (y - high)) * 2.0 / (2.0 * 0.3)
        assert np.abs(u[wet] - np.stack([exact, 0.0 * exact], axis=-1)).max() < 1e-12
        assert np.abs(p[wet]).max() < 1e-12
        drag = fluid.force()["plate"].sum(axis=0)[0]
        assert drag == pytest.approx((low + 1.0 - high) / 2.0 * 2.0, abs=1e-12)
