"""Thin bodies that touch or overlap: nothing flows between them, and they carry the difference of the pressures."""

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, step, turned

from solvers.fluid.background.grid import uniform
from solvers.fluid.boundary.patches import Patch
from solvers.fluid.thin.regions import area_of
from solvers.fluid.thin.sheets import find_sheets

H = 0.1
DRAWS = (range(2), pytest.param(range(2, 20), marks=pytest.mark.slow))


def overlap(one, other):
    """The area that two convex polygons, counterclockwise, have in common (Sutherland, Hodgman)."""
    left = list(one)
    for a, b in zip(other, np.roll(other, -1, axis=0), strict=True):
        off = [(b[0] - a[0]) * (x[1] - a[1]) - (b[1] - a[1]) * (x[0] - a[0]) for x in left]
        kept = []
        for k, (x, d) in enumerate(zip(left, off, strict=True)):
            following, its = left[(k + 1) % len(left)], off[(k + 1) % len(left)]
            kept += [x] if d >= 0.0 else []
            kept += [x + (following - x) * d / (d - its)] if d * its < 0.0 else []
        left = kept
        if not left:
            return 0.0
    return area_of(np.array(left))


@pytest.mark.parametrize("shift", [None, (0.3, 0.3), (0.5, 0.2)])
def test_area_of_the_fluid(shift):
    """Two plates of 0.3 cells that cross, that touch along their sides, that overlap there: exact in all cells."""
    grid = uniform([0, 0], [1, 1], [10, 10])
    plate, facets = block([-0.35, -0.15 * H], [0.35, 0.15 * H])
    for draw in range(60):
        rng = np.random.default_rng(draw)
        angles, middle = rng.uniform(0.0, 3.1, 2), 0.5 + rng.uniform(-0.1, 0.1, 2)
        one = turned(plate, angles[0]) + middle
        other = turned(plate, angles[1]) if shift is None else turned(plate + np.array(shift) * H, angles[0])
        both = np.concatenate([one, other + middle])
        sheets = find_sheets(grid, np.concatenate([facets, facets + 4]), both, np.ones(8, dtype=bool), always=True)
        exact = 1.0 - 2.0 * area_of(plate) + overlap(both[:4], both[4:])
        assert abs(sheets.fluid.sum() * H**2 - exact) < 1e-12, draw


def plates(thickness, depth, draw):
    """Two slanted plates from the walls of a channel, side by side over 1.5 cells, that overlap by a depth (cells)."""
    rng = np.random.default_rng(draw)
    t, angle, turn = thickness * H, rng.uniform(-0.5, 0.5), rng.uniform(-0.05, 0.05) * (depth > 0.0)
    middle = np.array([1.5, 0.5]) + rng.uniform(-0.1, 0.1, 2)
    below, facets = block([-t / 2, -2.0], [t / 2, 0.75 * H])
    above, _ = block([t / 2 - depth * H, -0.75 * H], [1.5 * t - depth * H, 2.0])
    return turned(below, angle) + middle, turned(above, angle + turn) + middle, facets


@pytest.mark.parametrize("draws", DRAWS, ids=str)
@pytest.mark.parametrize("depth", [0.0, 0.02, 0.5])
@pytest.mark.parametrize("thickness", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_two_plates_that_seal_a_channel(element, thickness, depth, draws):
    """Depth in thicknesses; both together carry (p1 - p2) A, and nothing flows."""
    for draw in draws:
        below, above, facets = plates(thickness, depth * thickness, draw)
        patches = [
            Patch("in", ("x-",), "traction", field(1.0, 0.0)),
            Patch("out", ("x+",), "traction", field(-0.3, 0.0)),
            Patch("w", ("y-", "y+"), "slip"),
        ]
        fluid = make_fluid(
            uniform([0, 0], [3, 1], [30, 10]), patches, [body("below", below, facets), body("above", above, facets)],
            element=element, mu=0.05, dt=0.1,
        )  # fmt: skip
        step(fluid, 0.0, 0.1)
        force = sum(one.sum(axis=0) for one in fluid.force().values())
        assert np.abs(fluid.flow[fluid.unknowns.velocity.dofs]).max() < 1e-8, draw
        assert abs(force[0] - 0.7) < 1e-8, draw


@pytest.mark.parametrize("draws", DRAWS, ids=str)
@pytest.mark.parametrize("thickness", [0.05, 0.3])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_two_plates_that_move_along_a_channel(element, thickness, draws):
    """They overlap, and move with the fluid by 0.7 cells in each step: it stays uniform, and they carry (p1 - p2) A."""
    # nodes of second degree at slivers of fluid are extended from far away
    exact = {"q1q1": 1e-8, "q2q1": 1e-6}[element]
    along, speed, dt = np.array([1.0, 0.0]), 0.7, H
    for draw in draws:
        below, above, facets = plates(thickness, 0.1 * thickness, draw)
        patches = [
            Patch("in", ("x-",), "traction", field(1.0, 0.0)),
            Patch("out", ("x+",), "traction", field(-0.3, 0.0)),
            Patch("w", ("y-", "y+"), "slip"),
        ]
        moved = {"motion": lambda x, t: (x + speed * t * along, 0.0 * x + speed * along)}
        fluid = make_fluid(
            uniform([0, 0], [3, 1], [30, 10]), patches,
            [body("below", below, facets, **moved), body("above", above, facets, **moved)],
            element=element, mu=0.05, dt=dt, initial_velocity=field(speed, 0.0),
        )  # fmt: skip
        for count in range(3):
            step(fluid, count * dt, dt)
            nodes = fluid.unknowns.velocity.dofs
            velocity = fluid.flow[nodes][fluid.system.active_dofs[nodes[:, 0]]]
            force = sum(one.sum(axis=0) for one in fluid.force().values())
            assert np.abs(velocity - speed * along).max() < exact, draw
            assert abs(force[0] - 0.7) < 1e-8, draw
