"""Bodies that overlap in 3D: the flow sees their union."""

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, sphere, step
from thin_space import turn

from solvers.fluid.flow.probes import of_fluid
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

LOAD, CELLS = 3.0, 6


def pool(bodies, element="q1q1", scale=1.0):
    """A fluid at rest under a body force, after one step."""
    patches = [Patch("walls", ("x-", "x+", "y-", "y+", "z-"), "no_slip"), Patch("top", ("z+",), "outflow")]
    grid = uniform([0, 0, 0], [scale] * 3, [CELLS] * 3)
    named = [body(f"body_{k}", scale * x, facets) for k, (x, facets) in enumerate(bodies)]
    fluid = make_fluid(grid, patches, named, mu=1.0, element=element, body_force=field(0, 0, -LOAD))
    step(fluid, 0.0, 1.0)
    return fluid


def assert_union(fluid, solid, scale=1.0):
    """Volume of the fluid, closed surface, no flow, buoyancy of the union."""
    cut = fluid.cut
    areas = cut.pieces.moments.sum(axis=(1, 2))
    assert np.abs(areas @ cut.pieces.normal).max() < 1e-11 * scale**2
    assert of_fluid(fluid, "volume")()[""] / scale**3 == pytest.approx(1.0 - solid, abs=1e-11)
    assert np.abs(fluid.velocity()).max() < 1e-8
    force = sum(each.sum(axis=0) for each in fluid.force().values()) / scale**3
    assert force == pytest.approx([0.0, 0.0, LOAD * solid], abs=1e-8)


def cross(depth, shift):
    """Two turned blocks: the end of one is in the other by a depth; (bodies, volume of their union)."""
    matrix, middle = turn(0.3, -0.4), 0.5 + np.asarray(shift)
    post, facets = block([-0.08, -0.09, -0.3], [0.08, 0.1, 0.3])
    arm, _ = block([0.08 - depth, -0.05, -0.07], [0.28, 0.06, 0.05])
    common = 0.11 * 0.12 * depth
    volume = 0.16 * 0.19 * 0.6 + (0.2 + depth) * 0.11 * 0.12 - common
    return [(x @ matrix.T + middle, facets) for x in (post, arm)], volume


@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow(seconds=20))])
@pytest.mark.parametrize("depth", [0.0, 1e-9, 1e-4, 0.05])
def test_arm_in_a_post(depth, element):
    """It touches or overlaps, turned; moved by a third of a cell."""
    for shift in (0.0, 1.0 / 3.0 / CELLS):
        bodies, solid = cross(depth, [shift, 0.0, 0.0])
        assert_union(pool(bodies, element), solid)


def test_order_scale_and_a_body_within():
    """The bodies in the other order, 1e-3 times as large, beside a ball that is within the post."""
    bodies, solid = cross(0.05, [0.0] * 3)
    ball, facets = sphere((0.5, 0.5, 0.5), 0.04, 1)
    assert_union(pool([(ball, facets), *bodies[::-1]]), solid)
    assert_union(pool(bodies, scale=1e-3), solid, 1e-3)


def test_ball_in_the_wall_of_a_shell():
    """A cavity belongs to the body around it: the fluid in it stays, less what the ball has of it."""
    outer, facets = block([0.2, 0.2, 0.2], [0.8, 0.8, 0.8])
    inner, _ = block([0.31, 0.31, 0.31], [0.69, 0.69, 0.69])
    shell = np.concatenate([outer, inner]), np.concatenate([facets, facets[:, ::-1] + len(outer)])
    plug = block([0.25, 0.4, 0.4], [0.45, 0.6, 0.6])
    fluid = pool([shell, plug])
    solid = 0.6**3 - 0.38**3 + (0.45 - 0.31) * 0.2**2
    assert of_fluid(fluid, "volume")()[""] == pytest.approx(1.0 - solid, abs=1e-11)


def test_moving_bodies_that_come_to_overlap():
    """The volume is that of the union in each step, as they come, overlap, pass and part."""
    base, facets = block([0.3, 0.3, 0.2], [0.6, 0.7, 0.45])
    plate, _ = block([0.37, 0.37, 0.5], [0.53, 0.53, 0.62])
    patches = [Patch("open", ("x-", "x+", "y-", "y+", "z-", "z+"), "outflow")]
    moves = body("plate", plate, facets, motion=lambda x, t: (x - [0, 0, t], 0.0 * x - [0, 0, 1.0]))
    fluid = make_fluid(uniform([0] * 3, [1] * 3, [CELLS] * 3), patches, [body("base", base, facets), moves], mu=1.0)
    for k in range(8):
        step(fluid, 0.04 * k, 0.04)
        down = 0.04 * (k + 1)
        common = 0.16**2 * (min(0.62 - down, 0.45) - max(0.5 - down, 0.2)) * (0.5 - down < 0.45)
        solid = 0.3 * 0.4 * 0.25 + 0.16**2 * 0.12 - common
        assert of_fluid(fluid, "volume")()[""] == pytest.approx(1.0 - solid, abs=1e-11), k
