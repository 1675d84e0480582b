"""Bodies that overlap, as a flag clamped in a cylinder: the flow sees their union."""

from itertools import pairwise

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, step
from test_fluid_touching import area_of, overlap

from solvers import kernels
from solvers.fluid.cut.cut import Cutter
from solvers.fluid.flow.probes import of_fluid
from solvers.fluid.geometry.overlaps import Unions
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.surface import Motion
from solvers.fluid.terms.boundary.patches import Patch
from solvers.mesh.gauss import gauss
from solvers.mesh.tessellation import unit_normals

WEIGHT = 3.0


def cylinder_and_flag(draw):
    """Corners of both; the lower side of the flag is 1e-4 to 1e-2 cells above a plane of the grid."""
    rng = np.random.default_rng(draw)
    angle = 2.0 * np.pi * np.arange(60) / 60
    centre = np.array([0.35, 0.55]) + rng.uniform(-0.05, 0.05, 2)
    low = 0.45 + 0.05 * 10.0 ** rng.uniform(-4.0, -2.0)
    flag, facets = block([centre[0] + 0.1, low], [0.8, low + 0.21 + rng.uniform(0.0, 0.03)])
    return centre + 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1), flag, facets


def flag_in_planes():
    """As `cylinder_and_flag`; all sides of the flag lie in planes of the grid, two cells apart."""
    angle = 2.0 * np.pi * np.arange(60) / 60
    return [0.35, 0.5] + 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1), *block([0.35, 0.45], [0.8, 0.55])


def rectangles_in_planes(draw):
    """Corners of two rectangles that touch or overlap, in planes of the grid or in the middle between them."""
    rng = np.random.default_rng(draw)
    while True:
        low = rng.integers(4, 24, (2, 2))
        high = low + rng.integers(4, 14, (2, 2))
        if (high.min(axis=0) >= low.max(axis=0)).all():
            (one, _), (other, facets) = (block(*corners) for corners in zip(low / 40, high / 40, strict=True))
            return one, other, facets


def at_rest(cylinder, flag, facets, element):
    patches = [Patch("walls", ("x-", "x+", "y-"), "no_slip"), Patch("top", ("y+",), "outflow")]
    bodies = [body("cylinder", cylinder, loop(len(cylinder))), body("flag", flag, facets)]
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [20, 20]), patches, bodies, mu=1.0, element=element, body_force=field(0, -WEIGHT)
    )
    step(fluid, 0.0, 1.0)
    return fluid, 1.0 - area_of(cylinder) - area_of(flag) + overlap(cylinder, flag)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("draw", range(6))
def test_fluid_at_rest(draw, element):
    """Its area is exact, the surface is closed, nothing flows, and the union of the bodies has its buoyancy."""
    fluid, area = at_rest(*cylinder_and_flag(draw), element)
    balanced(fluid, area)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_sides_in_planes_of_the_grid(element):
    """The sides of the flag inside of the cylinder bound no fluid: cells beside them are not active."""
    fluid, area = at_rest(*flag_in_planes(), element)
    assert fluid.cut.fraction[fluid.cut.active].min() > 1e-3
    balanced(fluid, area)


@pytest.mark.parametrize("draw", [*range(3, 9), 29, *(pytest.param(n, marks=pytest.mark.slow) for n in range(30, 50))])
def test_rectangles_in_planes_of_the_grid(draw):
    """They touch, have common sides or corners in the sides of the other one."""
    balanced(*at_rest(*rectangles_in_planes(draw), "q2q1"))


def disc(centre, radius, sides=48):
    angle = 2.0 * np.pi * np.arange(sides) / sides
    return centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.mark.parametrize("inner", [0.3, 0.15, 0.02], ids=["the same place", "some cells", "part of a cell"])
def test_disc_within_a_disc(inner):
    """What is inside of another body changes neither the area nor the forces."""
    outer = disc([0.51, 0.52], 0.3)
    within = disc([0.51, 0.52], inner)
    balanced(*at_rest(outer, within, loop(len(within)), "q1q1"))


def balanced(fluid, area):
    cut = fluid.cut
    lengths = cut.pieces.moments.sum(axis=(1, 2))
    assert np.abs(lengths @ cut.pieces.normal).max() < 1e-12
    inside = np.concatenate([cut.uncut, cut.cut])
    assert cut.fraction[inside].sum() / 400 == pytest.approx(area, abs=1e-12)
    assert of_fluid(fluid, "volume")()[""] == pytest.approx(area, abs=1e-12)
    assert np.abs(fluid.velocity()).max() < 1e-8
    force = sum(each.sum(axis=0) for each in fluid.force().values())
    assert force == pytest.approx([0.0, WEIGHT * (1.0 - area)], abs=1e-8)


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("gap", [-0.2, -1e-11, 1e-11, 0.2])
def test_slit_between_two_bodies(gap, turns):
    """Two bodies fill a cell but for a slit, or overlap: fluid is where the slit is, however narrow."""
    up = np.array([[0.4, -1.0], [0.4, 0.0], [0.5, 0.4], [0.4, 1.0], [0.4, 2.0]])
    one = np.concatenate([up, [[-1.0, 2.0], [-1.0, -1.0]]])
    other = np.concatenate([up[::-1] + np.array([gap, 0.0]), [[2.0, -1.0], [2.0, 2.0]]])
    x = np.concatenate([one, other]) - 0.5
    for _ in range(turns):
        x = np.stack([-x[:, 1], x[:, 0]], axis=1)
    facets, points = np.concatenate([loop(7), loop(7) + 7]), gauss(3)[0]
    grid = uniform([0, 0], [1, 1], [1, 1])
    moments = kernels.moments(grid.edges, points, x + 0.5, facets, np.ones(1, dtype=bool))
    normal = -unit_normals(x[facets])
    found, _ = Unions(grid, points)(moments, facets, x + 0.5, normal, None)
    assert max(0.0, 1.0 - found.fraction[0]) == pytest.approx(max(gap, 0.0), abs=1e-14)
    if gap > 0.0:
        assert found.piece_mass.sum() == pytest.approx(moments.piece_mass.sum(), abs=1e-12)


def test_overlaps_that_rest_and_overlaps_that_move():
    """What is kept from one cut to the next does not change a bit, wherever bodies move, rest or come back."""
    flag, facets = block([0.5, 0.45], [0.82, 0.58])
    lines = [disc([0.4, 0.5], 0.2, 60), flag, circle([0.8, 0.52], 0.1, 20)]
    starts = np.cumsum([0, *(len(line) for line in lines)])
    facets = np.concatenate([loop(60), facets + starts[1], loop(20) + starts[2]])
    fluid = make_fluid(uniform([0, 0], [1, 1], [20, 20]), [Patch("open", ("x-", "x+", "y-", "y+"), "outflow")])
    points = fluid.system.weights.points
    several = Cutter(fluid.grid, points, unions=True)
    for shift in ([0.0, 0.0], [0.013, 0.0], [0.013, -0.04], [0.0, 0.0]):
        x = np.concatenate([lines[0], lines[1], lines[2] + shift])
        motion = Motion(x, np.zeros_like(x))
        found, exact = several(facets, motion, 0), Cutter(fluid.grid, points, unions=True)(facets, motion, 0)
        several.begin_step()
        assert np.array_equal(found.fluid, exact.fluid)
        assert np.array_equal(found.pieces.moments, exact.pieces.moments)
        area = 1.0 - sum(area_of(x[a:b]) for a, b in pairwise(starts))
        area += overlap(x[: starts[1]], x[starts[1] : starts[2]]) + overlap(x[starts[2] :], x[starts[1] : starts[2]])
        assert (found.share.sum() / 400) == pytest.approx(area, abs=1e-12)
