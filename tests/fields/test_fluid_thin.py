"""Bodies of any thickness: the fluid on one side does not know of that on the other."""

import numpy as np
import pytest
from fluid_setup import block, body, field, fluid_rule, loop, make_fluid, solve_steady, step, turned, values
from programs import fsci

from fsci.running.history import read_history
from solvers.fluid.flow.probes import at_point
from solvers.fluid.geometry.thin.sheet_windows import SheetWindows
from solvers.fluid.geometry.thin.sheets import find_sheets
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.terms.boundary.patches import Patch
from solvers.mesh.distributed import gather, scatter
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

THICKNESS = [1e-3, 0.2, 1.0, 1.5, 3.0]  # in cells
DRAWS = (range(7), pytest.param(range(7, 20), marks=pytest.mark.slow))


def channel(plate, element, pressures):
    """A channel with slip walls, closed by a plate, with given pressures at its ends."""
    patches = [
        Patch("in", ("x-",), "traction", field(pressures[0], 0.0)),
        Patch("out", ("x+",), "traction", field(-pressures[1], 0.0)),
        Patch("w", ("y-", "y+"), "slip"),
    ]
    fluid = make_fluid(
        uniform([0, 0], [3, 1], [30, 10]), patches, [body("plate", *plate)], element=element, scheme="steady",
        convection=False,
    )  # fmt: skip
    solve_steady(fluid)
    return fluid


def sealed(thickness, element, draw, pressures=(2.0, 0.7)):
    """A plate at a random place and angle: the flow, its largest velocity, what the force is off."""
    rng = np.random.default_rng(draw)
    h, angle = 0.1, rng.uniform(-0.6, 0.6)
    middle = np.array([1.5, 0.5]) + rng.uniform(-0.1, 0.1, 2)
    points, facets = block([-thickness * h / 2, -0.9], [thickness * h / 2, 0.9])
    points = turned(points, angle) + middle
    fluid = channel((points, facets), element, pressures)
    length = 1.0 / np.cos(angle)
    exact = (pressures[0] - pressures[1]) * length * np.array([np.cos(angle), np.sin(angle)])
    speed = np.abs(fluid.flow[fluid.unknowns.velocity.dofs]).max()
    return fluid, speed, fluid.force()["plate"].sum(axis=0) - exact


@pytest.mark.parametrize("draws", DRAWS, ids=str)
@pytest.mark.parametrize("thickness", THICKNESS)
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_plate_that_seals_a_channel(element, thickness, draws):
    """Pressures on both sides are constant; nothing flows, and the plate carries their difference."""
    for draw in draws:
        _, speed, off = sealed(thickness, element, draw)
        assert speed < 1e-9, draw
        assert np.abs(off).max() < 1e-8, draw


@pytest.mark.parametrize("corners", [4, 6, 16])
def test_thick_bodies_have_no_extra_cells(corners):
    """Bodies of 2.4 cells and more, with corners of 90 degrees and more, anywhere in the grid."""
    rng = np.random.default_rng(corners)
    facets = np.stack([np.arange(corners), (np.arange(corners) + 1) % corners], axis=1)
    for radius in (1.2, 2.0, 4.0):
        for _ in range(15):
            angles = 2.0 * np.pi * np.arange(corners) / corners + rng.uniform(0.0, 6.0)
            around = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            points = 10.0 + rng.uniform(-1.0, 1.0, 2) + around
            grid = uniform([0, 0], [20, 20], [20, 20])
            assert find_sheets(grid, facets, points, np.ones(corners, dtype=bool)) is None


@pytest.mark.parametrize("shift", [-1e-12, 0.0, 1e-12])
@pytest.mark.parametrize("thickness", [0.2, 1.0, 2.0])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_plate_in_a_plane_of_the_grid(element, thickness, shift):
    """One of its sides, or both."""
    for side in (1.5, 1.6, 1.7 - 0.1 * thickness):
        fluid = channel(block([side + shift, -0.5], [side + shift + 0.1 * thickness, 1.5]), element, (1.0, 0.0))
        assert np.abs(fluid.flow[fluid.unknowns.velocity.dofs]).max() < 1e-10
        assert np.abs(fluid.force()["plate"].sum(axis=0) - [1.0, 0.0]).max() < 1e-8


def test_probes_on_both_sides():
    """Points in one cell, with a plate between them."""
    fluid = channel(block([1.53, -0.5], [1.55, 1.5]), "q1q1", (2.0, 0.5))
    for x, pressure in ((1.52, 2.0), (1.5299, 2.0), (1.5501, 0.5), (1.59, 0.5)):
        assert abs(at_point(fluid, "pressure", (x, 0.47), 0.0)()[""] - pressure) < 1e-10


def two_channels(thickness, middle, grid):
    """Flow on both sides of a plate along a channel, driven by a force, and the exact one; lengths in heights."""
    h = grid.edges[1][1]
    low, high = middle - thickness * h / 2, middle + thickness * h / 2
    patches = [Patch("ends", ("x-", "x+"), "outflow"), Patch("w", ("y-", "y+"), "no_slip")]
    fluid = make_fluid(
        grid, patches, [body("plate", *block([-0.5, low], [1.5, high]))],
        element="q2q1", scheme="steady", convection=False, mu=0.3, body_force=field(2.0, 0.0),
    )  # fmt: skip
    solve_steady(fluid)
    rule = fluid_rule(fluid)
    u, _, p = values(fluid, rule)
    wet = rule.weights.sum(axis=1) > 1e-9
    rule_y, weights = rule.x[wet, :, 1], rule.weights[wet]
    below = (rule_y * weights).sum(axis=1) / weights.sum(axis=1) < middle
    exact = np.where(below[:, None], rule_y * (low - rule_y), (1.0 - rule_y) * (rule_y - high)) * 2.0 / (2.0 * 0.3)
    off = np.abs(u[wet] - np.stack([exact, 0.0 * exact], axis=-1)).max()
    drag = fluid.force()["plate"].sum(axis=0)[0]
    return off, np.abs(p[wet]).max(), drag - (low + 1.0 - high) / 2.0 * 2.0


@pytest.mark.parametrize("nested", [False, True], ids=["equal cells", "nested cells"])
@pytest.mark.parametrize(
    "thickness", [1e-3, pytest.param(0.2, marks=pytest.mark.slow), 1.0, pytest.param(1.5, marks=pytest.mark.slow)]
)
def test_two_parabolas(thickness, nested):
    """Both flows are exact, also where the plate leaves the box, and in coarser cells; it carries half of the force."""
    equal = uniform([0, 0], [1, 1], [6, 10])
    grid = refined(equal, [RefinedBox([0.0, 0.2], [1.0, 0.8], 1)]) if nested else equal
    away = 0.1 if nested else 0.2  # from half of the height, where cells are fine
    for middle in np.random.default_rng(5).uniform(0.5 - away, 0.5 + away, 8):
        assert np.abs(two_channels(thickness, middle, grid)).max() < 1e-12, middle


def test_nodes_depend_on_their_own_side():
    """Cells near a node are those that it sees: none behind a plate, next to the tip either, all in front of it."""
    plate, facets = block([0.5, 0.503], [1.5, 0.513])
    grid = uniform([0, 0], [1, 1], [10, 10])
    sheets = find_sheets(grid, facets, plate, np.ones(4, dtype=bool))
    steps = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
    below, above = sorted(sheets.successors[57], key=lambda cell: sheets.shares[cell].fraction)
    for cell, side in ((above, 1), (below, -1)):
        nodes = sheets.nodes(np.array([cell]), 1, steps)[0]
        index = np.stack(np.unravel_index(sheets.on_lattice(nodes, 1), (11, 11), order="F"), axis=1)
        found, exists = SheetWindows(sheets, 1, nodes).cells_around(np.arange(4), index, 2)
        seen = set(found[exists].tolist())
        column, row = np.unravel_index(sheets.box_cells(np.array(sorted(seen))), (10, 10), order="F")
        assert (side * (row - 5) >= 0)[column >= 5].all()
        assert seen >= {cell, 57 + 10 * side, 56 + 20 * side}
    tip = np.array([6 + 11 * 6])  # above the plate, a cell behind its tip
    found, exists = SheetWindows(sheets, 1, tip).cells_around(np.array([0]), np.array([[6, 6]]), 2)
    assert {54, 53} <= set(found[exists].tolist())  # in front of the tip
    assert not {45, 46, 47} & set(found[exists].tolist())  # below the plate


def flag(points=160):
    """The cylinder and the flag of Turek and Hron."""
    angles = np.arcsin(0.2) + np.linspace(0.0, 2.0 * np.pi - 2.0 * np.arcsin(0.2), points)
    arc = 0.2 + 0.05 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return body("flag", np.concatenate([arc, [[0.6, 0.19], [0.6, 0.21]]]), loop(points + 2))


def test_flag_as_thick_as_a_cell():
    """CFD1: drag and lift within 3 % of those of Turek and Hron (2006), which cells of half the size have too."""
    inflow = field(lambda x, y, t: 1.5 * 0.2 * y * (0.41 - y) * 4 / 0.1681, 0.0)
    patches = [
        Patch("in", ("x-",), "velocity", inflow), Patch("out", ("x+",), "outflow"), Patch("w", ("y-", "y+"), "no_slip"),
    ]  # fmt: skip
    fluid = make_fluid(
        uniform([0, 0], [1.5, 0.41], [75, 20]), patches, [flag()], element="q2q1", scheme="steady", rho=1000.0,
        solver=SolverSettings(Tolerance(residual=1e-9), linear="direct"),
    )  # fmt: skip
    solve_steady(fluid)
    assert fluid.grid.sheets is not None
    assert fluid.force()["flag"].sum(axis=0) == pytest.approx([14.29, 1.119], rel=0.03)


def split(element):
    """A channel with a plate in its middle, thinner than a cell, that begins within the box and ends behind it."""
    plate, facets = block([0.62, 0.5], [2.5, 0.5 + 0.02])
    inflow = field(lambda x, y, t: 6 * y * (1 - y) * np.minimum(1.0, 0.5 + t), 0.0)
    patches = [
        Patch("in", ("x-",), "velocity", inflow), Patch("out", ("x+",), "outflow"), Patch("w", ("y-", "y+"), "no_slip"),
    ]  # fmt: skip
    return make_fluid(
        uniform([0, 0], [1.5, 1], [15, 10]), patches, [body("plate", turned(plate, 0.1, (0.6, 0.5)), facets)],
        mu=0.05, element=element,
    )  # fmt: skip


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_resumed(element):
    """The state holds the unknowns of both sides: steps after it are the same bit for bit."""
    fluid, again = (split(element) for _ in range(2))
    for number in range(3):
        step(fluid, 0.1 * number, 0.1)
    again.restore(scatter(fluid.comm, gather(fluid.comm, fluid.save()), again.save()))
    for one in (fluid, again):
        step(one, 0.3, 0.1)
    assert np.array_equal(fluid.flow, again.flow)
    assert fluid.grid.sheets is not None


CASE = """\
time: {{step: 0.1, end: 0.3}}
fluid:
  density: 1
  viscosity: 0.02
  element: {element}
  grid: {{from: [0, 0], to: [1.5, 1], cells: [15, 10]}}
  patches:
    inlet: {{on: x-, velocity: ["6*y*(1-y)", 0]}}
    outlet: {{on: x+, outflow: true}}
    walls: {{on: [y-, y+], no_slip: true}}
  bodies:
    plate: {{mesh: {{shape: rectangle, size: [1.2, 0.013], cells: [12, 1], origin: [0.618, 0.543]}}}}
probes:
  force: {{quantity: force, body: plate}}
  above: {{quantity: pressure, at: [0.9, 0.57]}}
  below: {{quantity: pressure, at: [0.9, 0.53]}}
"""


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.slow
def test_two_processes(tmp_path, element):
    """A plate in the middle of the flow, its tip within the box, its end behind the outlet; a run that goes on, too."""
    (tmp_path / "case.yaml").write_text(CASE.format(element=element))
    found = []
    for processes in (1, 2):
        out = tmp_path / str(processes)
        done = fsci("run", tmp_path, "-o", out, processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        done = fsci("resume", out, "--set", "time.end=0.5", processes=3 - processes)
        assert done.returncode == 0, done.stdout + done.stderr
        history = read_history(out / "history.csv")
        assert len(history["above"]) == 5
        found.append([history[name][-1] for name in ("force.x", "force.y", "above", "below", "fluid.mass")])
    assert np.allclose(found[1], found[0], rtol=1e-8, atol=1e-10)
