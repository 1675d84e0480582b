"""Bodies of any thickness at rest in 3D: the fluid on one side does not know of that on the other."""

import numpy as np
import pytest
from fluid_setup import block, body, field, fluid_rule, make_fluid, solve_steady, sphere, step, values
from programs import fsci
from scipy.spatial import ConvexHull
from thin_space import duct, sealing, turn

from fsci.running.history import read_history
from solvers.fluid.flow.probes import at_point
from solvers.fluid.geometry.thin import thinness
from solvers.fluid.geometry.thin.sheets import find_sheets
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch
from solvers.mesh.distributed import gather, scatter

SLOW = pytest.mark.slow
THICKNESS = [pytest.param(1e-3, marks=SLOW), 0.2, pytest.param(1.0, marks=SLOW), 1.5, pytest.param(3.0, marks=SLOW)]
DRAWS = (range(1), pytest.param(range(1, 20), marks=SLOW))


@pytest.mark.parametrize("draws", DRAWS, ids=str)
@pytest.mark.parametrize("thickness", THICKNESS)
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_plate_that_seals_a_duct(element, thickness, draws):
    """Pressures on both sides are constant; nothing flows, and the plate carries their difference."""
    for draw in draws:
        fluid, force = sealing(thickness, element, draw)
        solve_steady(fluid)
        assert np.abs(fluid.flow[fluid.unknowns.velocity.dofs]).max() < 1e-9, draw
        assert np.abs(fluid.force()["plate"].sum(axis=0) - force).max() < 1e-8, draw


@pytest.mark.parametrize("shift", [-1e-12, 0.0, 1e-12])
@pytest.mark.parametrize("thickness", [0.2, 1.0])
def test_plate_in_a_plane_of_the_grid(thickness, shift):
    """One of its sides, or both; its edges are in planes of the grid and of the box."""
    for side, across in ((0.75, [0.0, 0.75]), (1.0 - 0.25 * thickness, [-0.25, 1.0])):
        low, high = ([x, y, y] for x, y in zip((side + shift, side + shift + 0.25 * thickness), across, strict=True))
        fluid = duct([body("plate", *block(low, high))], "q1q1", (1.0, 0.0), scheme="steady")
        solve_steady(fluid)
        assert np.abs(fluid.flow[fluid.unknowns.velocity.dofs]).max() < 1e-10
        assert np.abs(fluid.force()["plate"].sum(axis=0) - [0.75**2, 0.0, 0.0]).max() < 1e-8


def test_probes_on_both_sides():
    """Points in one cell, with a slanted plate between them."""
    points, facets = block([-0.003, -0.8, -0.8], [0.003, 0.8, 0.8])
    matrix, middle = turn(0.3, 0.2), np.array([0.87, 0.39, 0.4])
    fluid = duct([body("plate", points @ matrix.T + middle, facets)], "q1q1", (2.0, 0.5), scheme="steady")
    solve_steady(fluid)
    for way, pressure in ((-0.02, 2.0), (-0.0031, 2.0), (0.0031, 0.5), (0.02, 0.5)):
        assert abs(at_point(fluid, "pressure", tuple(middle + way * matrix[:, 0]), 0.0)()[""] - pressure) < 1e-10


def two_ducts(element, thickness, middle, axis, wall):
    """Flow along a plate that divides a duct, driven by a force and by a wall; velocity and force less the exact."""
    h, across = 1.0 / 6.0, 1.0
    low, high = middle - thickness * h / 2, middle + thickness * h / 2
    sizes, cells, faces = [0.5, 0.5, 0.5], [2, 2, 2], ["x", "y", "z"]
    along, side = (axis + 1) % 3, (axis + 2) % 3
    sizes[axis], cells[axis] = across, 6
    force = 2.0 if element == "q2q1" else 0.0
    moving = [0.0, 0.0, 0.0]
    moving[along] = wall
    ends, walls, sides = ([faces[a] + "-", faces[a] + "+"] for a in (along, axis, side))
    patches = [
        Patch("ends", tuple(ends), "outflow"), Patch("sides", tuple(sides), "slip"),
        Patch("low", (walls[0],), "no_slip"), Patch("high", (walls[1],), "velocity", field(*moving)),
    ]  # fmt: skip
    corners = [[-0.5] * 3, [1.5] * 3]
    corners[0][axis], corners[1][axis] = low, high
    pull = [0.0, 0.0, 0.0]
    pull[along] = force
    fluid = make_fluid(
        uniform([0, 0, 0], sizes, cells), patches, [body("plate", *block(*corners))],
        element=element, scheme="steady", convection=False, mu=0.3, body_force=field(*pull),
    )  # fmt: skip
    solve_steady(fluid)
    rule = fluid_rule(fluid)
    u, _, p = values(fluid, rule)
    wet = rule.weights.sum(axis=1) > 1e-9
    s, weights = rule.x[wet, :, axis], rule.weights[wet]
    below = ((s * weights).sum(axis=1) / weights.sum(axis=1) < middle)[:, None]
    exact = np.zeros_like(u[wet])
    upper = (1.0 - s) * (s - high) * force / 0.6 + wall * (s - high) / (1.0 - high)
    exact[:, :, along] = np.where(below, s * (low - s) * force / 0.6, upper)
    drag = fluid.force()["plate"].sum(axis=0)[along]
    return [
        np.abs(u[wet] - exact).max(),
        np.abs(p[wet]).max(),
        drag - 0.25 * ((low + 1.0 - high) / 2.0 * force + 0.3 * wall / (1.0 - high)),
    ]


@pytest.mark.parametrize("thickness", THICKNESS[:4])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_flows_on_both_sides(element, thickness):
    """Linear with q1q1, two parabolas and a line with q2q1: both are exact, also where the plate leaves the box."""
    rng = np.random.default_rng(5)
    for axis in (1,) if element == "q2q1" else (0, 1, 2):
        off = two_ducts(element, thickness, rng.uniform(0.35, 0.65), axis, rng.uniform(0.3, 1.0))
        assert np.abs(off).max() < 1e-12, axis


def leaflet(cells, element):
    """The force of a flow through a duct on a slanted leaflet on its floor, with three of its edges in the fluid."""
    inflow = field(lambda x, y, z, t: 9.0 * y * (1.0 - y) * z * (1.0 - z), 0.0, 0.0)
    patches = [
        Patch("in", ("x-",), "velocity", inflow), Patch("out", ("x+",), "outflow"),
        Patch("w", ("y-", "y+", "z-", "z+"), "no_slip"),
    ]  # fmt: skip
    points, facets = block([-0.01, -0.35, -0.3], [0.01, 0.35, 0.55])
    points = points @ turn(0.0, 0.2).T + np.array([0.63, 0.5, 0.0])
    fluid = make_fluid(
        uniform([0, 0, 0], [1.4, 1, 1], [round(1.4 * cells), cells, cells]), patches, [body("leaf", points, facets)],
        element=element, scheme="steady", convection=False,
    )  # fmt: skip
    solve_steady(fluid)
    return fluid, fluid.force()["leaf"].sum(axis=0)


@pytest.mark.parametrize("corners", [1, pytest.param(2, marks=SLOW), pytest.param(3, marks=SLOW)])
def test_thick_bodies_have_no_extra_cells(corners):
    """Balls of 3 cells and boxes of 2.4 cells and more, anywhere in the grid."""
    rng = np.random.default_rng(corners)
    for radius in (1.5, 2.2, 3.5):
        for points, facets in (sphere((0, 0, 0), radius, corners), block([-0.8 * radius] * 3, [0.8 * radius] * 3)):
            x = points @ turn(*rng.uniform(-1.0, 1.0, 2)).T + 7.0 + rng.uniform(-1.0, 1.0, 3)
            grid = uniform([0, 0, 0], [14, 14, 14], [14, 14, 14])
            assert find_sheets(grid, facets, x, np.ones(len(facets), dtype=bool)) is None


def past_leaflet(element):
    """The beginning of a flow past a slanted plate thinner than a cell, with an edge in the fluid."""
    points, facets = block([-0.005, -1.2, -1.2], [0.005, 1.2, 0.95])
    inflow = field(lambda x, y, z, t: np.minimum(1.0, 0.5 + t) + 0.0 * x, 0.0, 0.0)
    patches = [
        Patch("in", ("x-",), "velocity", inflow), Patch("out", ("x+",), "outflow"),
        Patch("w", ("y-", "y+", "z-", "z+"), "slip"),
    ]  # fmt: skip
    return make_fluid(
        uniform([0, 0, 0], [1.25, 0.75, 1.5], [5, 3, 6]), patches,
        [body("leaf", points @ turn(0.3, 0.2).T + np.array([0.6, 0.4, 0.1]), facets)], mu=0.05, element=element,
    )  # fmt: skip


@pytest.mark.slow
def test_leaflet():
    """The force on a leaflet of 0.26 cells is that with finer cells; with shared nodes it is 8 % less."""
    (coarse, force), (_, finer) = (leaflet(cells, "q1q1") for cells in (13, 18))
    assert len(coarse.grid.sheets.cells) > 0
    assert force[[0, 2]] == pytest.approx(finer[[0, 2]], rel=0.06)
    assert force[0] == pytest.approx(finer[0], rel=0.02)


@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=SLOW)])
def test_resumed(element):
    """The state holds the unknowns of both sides: steps after it are the same bit for bit."""
    fluid, again = (past_leaflet(element) for _ in range(2))
    for number in range(2):
        step(fluid, 0.1 * number, 0.1)
    again.restore(scatter(fluid.comm, gather(fluid.comm, fluid.save()), again.save()))
    for one in (fluid, again):
        step(one, 0.2, 0.1)
    assert np.array_equal(fluid.flow, again.flow)
    assert len(fluid.grid.sheets.cells) > 0


CASE = """\
time: {{step: 0.1, end: 0.1}}
fluid:
  density: 1
  viscosity: 0.02
  scheme: backward_euler
  element: {element}
  grid: {{from: [0, 0, 0], to: [1, 0.5, 1.5], cells: [4, 2, 6]}}
  patches:
    inlet: {{on: x-, velocity: [1, 0, 0]}}
    outlet: {{on: x+, outflow: true}}
    walls: {{on: [y-, y+, z-, z+], slip: true}}
  bodies:
    plate:
      mesh: {{shape: box, size: [0.013, 2, 2], cells: [1, 1, 1], origin: [0.618, -0.5, -0.93]}}
probes:
  force: {{quantity: force, body: plate}}
  front: {{quantity: pressure, at: [0.61, 0.3, 0.3]}}
  back: {{quantity: pressure, at: [0.64, 0.3, 0.3]}}
"""


@pytest.mark.parametrize("at_once", [7, 256, 10**6])
@pytest.mark.parametrize(("thickness", "thin"), [(0.1, True), (2.4, True), (4.5, False)])
def test_points_that_tell_whether_a_plate_is_thin(monkeypatch, thickness, thin, at_once):
    """Some of a thin plate, all of a thick one, few at a time: no more than their pairs are in memory."""
    looked_at, parts, found = [], [], thinness._opposed

    def counted(points, normal):
        parts.append(-(-len(points) // at_once))
        for pairs in found(points, normal):
            looked_at.append(len(np.unique(pairs[0])))
            yield pairs

    monkeypatch.setattr(thinness, "_opposed", counted)
    monkeypatch.setattr(thinness, "POINTS_AT_ONCE", at_once)
    points, facets = block([0.3, 0.3, 1.0], [7.7, 7.7, 1.0 + thickness])
    assert thinness.may_be_thin(uniform([0, 0, 0], [8, 8, 8], [16, 16, 16]), facets, points, 5.0) == thin
    assert max(looked_at) <= at_once
    assert len(looked_at) <= 1 + parts[0] / 2 if thin else len(looked_at) == parts[0]


@pytest.mark.slow
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_two_processes(tmp_path, element):
    """A plate with an edge in the flow and the others behind walls; a run that goes on, too."""
    (tmp_path / "case.yaml").write_text(CASE.format(element=element))
    found = []
    for processes in (1, 2):
        out = tmp_path / str(processes)
        done = fsci("run", tmp_path, "-o", out, processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        done = fsci("resume", out, "--set", "time.end=0.2", processes=3 - processes)
        assert done.returncode == 0, done.stdout + done.stderr
        history = read_history(out / "history.csv")
        assert len(history["front"]) == 2
        found.append([history[name][-1] for name in ("force.x", "force.y", "front", "back", "fluid.mass")])
    assert np.allclose(found[1], found[0], rtol=1e-8, atol=1e-10)
    assert found[0][2] > found[0][3] + 0.1


@pytest.mark.parametrize("gap", [0.01, 0.3])
def test_thick_balls_side_by_side_are_not_thin(gap):
    """Between them is no solid; without the bodies of facets nobody could tell."""
    k = np.arange(300)
    turn, z = np.pi * (3.0 - np.sqrt(5.0)) * k, 1.0 - (2.0 * k + 1.0) / 300
    ball = np.stack([np.sqrt(1.0 - z**2) * np.cos(turn), np.sqrt(1.0 - z**2) * np.sin(turn), z], axis=1)
    hull = ConvexHull(ball)
    inward = np.linalg.det(ball[hull.simplices]) < 0.0
    facets = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)
    points = np.concatenate([[3.5, 4.1, 4.0] + 2.0 * ball, [7.5 + gap, 4.0, 4.1] + 2.0 * ball])
    both, grid = np.concatenate([facets, facets + 300]), uniform([0, 0, 0], [12, 8, 8], [24, 16, 16])
    assert thinness.may_be_thin(grid, both, points, 3.0)
    assert not thinness.may_be_thin(grid, both, points, 3.0, thinness.solid_of(both, points, None))
