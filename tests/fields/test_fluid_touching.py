"""Thin bodies that touch or overlap: nothing flows between them, and they carry the difference of the pressures."""

import numpy as np
import pytest
from fluid_setup import block, body, field, loop, make_fluid, step, turned

from solvers.fluid.geometry.thin.sheets import find_sheets
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

H = 0.1
DRAWS = (range(2), pytest.param(range(2, 20), marks=pytest.mark.slow))


def area_of(polygon):
    x, y = polygon.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


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
@pytest.mark.parametrize("depth", [0.0, pytest.param(0.02, marks=pytest.mark.slow), 0.5])
@pytest.mark.parametrize("thickness", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_two_plates_that_seal_a_channel(element, thickness, depth, draws):
    """Depth in thicknesses; both together carry (p1 - p2) A, and nothing flows."""
    for draw in draws:
        below, above, facets = plates(thickness, depth * thickness, draw)
        off = errors(element, (below, facets), (above, facets))
        assert (off < 1e-8).all(), draw


def errors(element, below, above, speed=0.0, steps=1):
    """Largest errors of the velocity and of the force on both bodies (points, facets), which move with the fluid."""
    along, dt = np.array([1.0, 0.0]), H
    patches = [
        Patch("in", ("x-",), "traction", field(1.0, 0.0)),
        Patch("out", ("x+",), "traction", field(-0.3, 0.0)),
        Patch("w", ("y-", "y+"), "slip"),
    ]
    moved = {"motion": lambda x, t: (x + speed * t * along, 0.0 * x + speed * along)} if speed else {}
    fluid = make_fluid(
        uniform([0, 0], [3, 1], [30, 10]), patches, [body("below", *below, **moved), body("above", *above, **moved)],
        element=element, mu=0.05, dt=dt, initial_velocity=field(speed, 0.0),
    )  # fmt: skip
    off = np.zeros(2)
    for count in range(steps):
        step(fluid, count * dt, dt)
        nodes = fluid.unknowns.velocity.dofs
        velocity = fluid.flow[nodes][fluid.system.active_dofs[nodes[:, 0]]]
        force = sum(one.sum(axis=0) for one in fluid.force().values())
        off = np.maximum(off, [np.abs(velocity - speed * along).max(), abs(force[0] - 0.7)])
    return off


@pytest.mark.parametrize("draws", [(0, 17), pytest.param(range(1, 20), marks=pytest.mark.slow)], ids=str)
@pytest.mark.parametrize(
    ("element", "thickness"),
    [
        ("q1q1", 0.05),
        ("q2q1", 0.3),
        *(pytest.param(*other, marks=pytest.mark.slow) for other in (("q1q1", 0.3), ("q2q1", 0.05))),
    ],
)
def test_two_plates_that_move_along_a_channel(element, thickness, draws):
    """They overlap, and move with the fluid by 0.7 cells in each step: it stays uniform, and they carry (p1 - p2) A."""
    # nodes of second degree at slivers of fluid are extended from far away
    exact = {"q1q1": 1e-8, "q2q1": 1e-6}[element]
    for draw in draws:
        below, above, facets = plates(thickness, 0.1 * thickness, draw)
        off = errors(element, (below, facets), (above, facets), speed=0.7, steps=3)
        assert (off < [exact, 1e-8]).all(), draw


def arc(radius, angles, thickness, length):
    """A curved plate: an arc of some thickness on its outside, in facets about as long as `length`."""
    s = np.linspace(*angles, max(2, int((angles[1] - angles[0]) * radius / length)) + 1)
    line = np.stack([np.cos(s), np.sin(s)], axis=1)
    return np.concatenate([(radius + thickness) * line, radius * line[::-1]])


def curved_plates(thickness, draw):
    """Two arcs that lie on each other over 0.5 to 3 cells, with facets of 0.3 to 3 cells: overlaps and slivers."""
    rng = np.random.default_rng(draw)
    radius, angle, t = rng.uniform(0.6, 3.0), rng.uniform(-0.2, 0.2), thickness * H
    half, common, lengths = 0.9 / radius, rng.uniform(0.5, 3.0) * H / radius, rng.uniform(0.3, 3.0, 2) * H
    below = arc(radius, (angle - half, angle + common), t, lengths[0])
    above = arc(radius + t, (angle - common, angle + half), t, lengths[1])
    middle = np.array([1.5, 0.5]) + rng.uniform(-0.1, 0.1, 2) - radius * np.array([np.cos(angle), np.sin(angle)])
    above[:, 0] += rng.uniform(-1.0, 1.0) * 1e-3 * H
    return below + middle, above + middle


@pytest.mark.parametrize("draws", [(1, 5), pytest.param(range(7), marks=pytest.mark.slow)], ids=str)
@pytest.mark.parametrize("thickness", [0.1, 0.3, 1.0])
@pytest.mark.parametrize(("element", "speed"), [("q1q1", 0.0), ("q2q1", 0.0), ("q1q1", 0.7)])
def test_curved_plates_with_different_facets(element, speed, thickness, draws):
    """Slivers of fluid between facets, up to a few cells long, have pressures of their own: nothing is lost."""
    for draw in draws:
        off = errors(element, *((x, loop(len(x))) for x in curved_plates(thickness, draw)), speed, 3 if speed else 1)
        assert (off < 1e-8).all(), draw
