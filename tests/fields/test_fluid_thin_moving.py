"""Thin bodies that move: the unknowns of each side follow the body, and nothing goes from one side to the other."""

from itertools import product

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, step, turned
from programs import fsci

from fsci.case.plausible_flow import CELLS_ACROSS_IN_CONTACT
from fsci.running.history import read_history
from solvers.api import StepFailed
from solvers.fluid.flow.sheet_transfer import along_surface, sides_of, transfer
from solvers.fluid.flow.thin_bodies import THICK_IN_CONTACT, ThinBodies, may_be_thin, solid_of
from solvers.fluid.geometry.pieces import off_boundary
from solvers.fluid.geometry.thin.sheets import find_sheets
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.surface import Motion
from solvers.fluid.terms.boundary.patches import Patch
from solvers.mesh.distributed import gather, scatter

THICKNESS = [1e-3, 0.2, 1.0, 1.5, 3.0]  # in cells
DRAWS = (range(1), pytest.param(range(1, 10), marks=pytest.mark.slow))
H = 0.1


def pushed(thickness, element, draw, cells_per_step=1.0, number=4, angles=(-0.6, 0.6)):
    """A plate at a random place and angle that seals a channel and moves along it: largest errors of all steps."""
    rng = np.random.default_rng(draw)
    angle, dt, pressures = rng.uniform(*angles), 0.1, (1.0, 0.7)
    plate, facets = block([-thickness * H / 2, -1.5], [thickness * H / 2, 1.5])
    plate = turned(plate, angle) + np.array([1.5, 0.5]) + rng.uniform(-0.1, 0.1, 2)
    along, speed = np.array([1.0, 0.0]), cells_per_step * H / dt
    patches = [
        Patch("in", ("x-",), "traction", field(pressures[0], 0.0)),
        Patch("out", ("x+",), "traction", field(-pressures[1], 0.0)),
        Patch("w", ("y-", "y+"), "slip"),
    ]
    fluid = make_fluid(
        uniform([0, 0], [3, 1], [30, 10]), patches,
        [body("plate", plate, facets, motion=lambda x, t: (x + speed * t * along, 0.0 * x + speed * along))],
        element=element, mu=0.05, dt=dt, initial_velocity=field(speed, 0.0),
    )  # fmt: skip
    force = (pressures[0] - pressures[1]) / np.cos(angle) * np.array([np.cos(angle), np.sin(angle)])
    off = np.zeros(2)
    for count in range(number):
        step(fluid, count * dt, dt)
        nodes = fluid.unknowns.velocity.dofs
        velocity = fluid.flow[nodes][fluid.system.active_dofs[nodes[:, 0]]]
        error = np.abs(velocity - speed * along).max(), np.abs(fluid.force()["plate"].sum(axis=0) - force).max()
        off = np.maximum(off, error)
    return off


@pytest.mark.parametrize("draws", DRAWS, ids=str)
@pytest.mark.parametrize("thickness", THICKNESS)
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_plate_that_moves_along_a_channel(element, thickness, draws):
    """Nothing passes it, and it carries the difference of the pressures in each step, also where it enters cells."""
    for draw in draws:
        assert (pushed(thickness, element, draw) < 1e-9).all(), draw


@pytest.mark.parametrize("draws", DRAWS, ids=str)
@pytest.mark.parametrize(
    "thickness", [3.2, pytest.param(3.5, marks=pytest.mark.slow), 4.2, pytest.param(5.0, marks=pytest.mark.slow), 5.5]
)
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_thicker_plate_that_hardly_moves(element, thickness, draws):
    """Strips behind both sides, of a cut cell and one more in any direction, would meet within five cells."""
    for draw in draws:
        assert (pushed(thickness, element, draw, cells_per_step=0.05, number=3) < 1e-9).all(), draw


@pytest.mark.parametrize("draws", DRAWS, ids=str)
@pytest.mark.parametrize(
    "thickness", [3.06, pytest.param(3.3, marks=pytest.mark.slow), 3.5, pytest.param(4.2, marks=pytest.mark.slow), 5.5]
)
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_inclined_plate_that_hardly_moves(element, thickness, draws):
    """Inclined by 35 to 50 degrees, its strips would meet in diagonal directions."""
    for draw in draws:
        off = pushed(thickness, element, draw, cells_per_step=0.05, number=3, angles=(0.6, 0.87))
        assert (off < 1e-8).all(), draw


def test_plate_that_moves_too_far():
    """By eight cells in a step: no side has been near."""
    with pytest.raises(
        StepFailed,
        match="body 'plate' moved by 8 cells in one step; velocities are extrapolated to 3 behind its surface",
    ):
        pushed(0.2, "q1q1", 0, cells_per_step=8.0, number=2)


def sheets_at(grid, facets, x):
    return find_sheets(grid, facets, x, off_boundary(grid, x[facets]), always=True)


def test_a_check_knows_the_thickness_in_contact():
    assert CELLS_ACROSS_IN_CONTACT == THICK_IN_CONTACT


@pytest.mark.parametrize("dim", [2, 3])
def test_body_outside_of_the_box(dim):
    """An increment may push it out: no cell has two sides then."""
    grid = uniform([0.0] * dim, [1.0] * dim, [6] * dim)
    x, facets = block([2.0] * dim, [2.1] + [2.5] * (dim - 1))
    sheets = sheets_at(grid, facets, x)
    assert sheets.size == grid.size
    assert not sheets.shares


def sides(sheets, degree, plate):
    """(numbers of the nodes with fluid, on which side of the plate each is: its cells are all on one)."""
    fluid = np.zeros(sheets.size, dtype=bool)
    fluid[: sheets.grid.size] = ~sheets.around
    fluid[sheets.links] = True
    along, middle = plate[2] - plate[1], plate.mean(axis=0)
    steps = np.array(list(product(range(degree + 1), repeat=2)))
    found = {}
    for cell in np.flatnonzero(fluid):
        wetted = set(sheets.bounds[sheets.bounds[:, 0] == cell, 1].tolist())
        index = np.array(np.unravel_index(sheets.box_cells(np.array([cell]))[0], sheets.grid.shape, order="F"))
        across = ((index + 0.5) * H - middle) @ [along[1], -along[0]]
        side = 1 if (1 in wetted if wetted else across > 0) else -1
        for node in sheets.nodes(np.array([cell]), degree, steps)[0].tolist():
            assert found.setdefault(node, side) == side
    return np.array(sorted(found)), np.array([found[node] for node in sorted(found)])


def polynomial(sheets, degree, nodes, side):
    """Another linear function on each side."""
    shape = [degree * n + 1 for n in sheets.grid.shape]
    x, y = np.stack(np.unravel_index(sheets.on_lattice(nodes, degree), shape, order="F")) * H / degree
    return np.where(side > 0, 1.0 + x - 2.0 * y, -3.0 * x + y + 5.0)


def between(old, new, degree, along):
    """The transfer between the nodes of two sheets."""
    return transfer(sides_of(old, degree, along), sides_of(new, degree, along))


@pytest.mark.parametrize("degree", [1, 2])
def test_each_side_keeps_its_values(degree):
    """Plates that turn and move by up to 1.4 cells in a step: linear functions on both sides stay what they are."""
    grid = uniform([0, 0], [1, 1], [10, 10])
    for draw in range(15):
        rng = np.random.default_rng(draw)
        thickness = rng.choice(THICKNESS) * H
        plate, facets = block([-thickness / 2, -1.0], [thickness / 2, 1.0])
        plate, middle = turned(plate, rng.uniform(0.0, 3.0)), 0.5 + rng.uniform(-0.1, 0.1, 2)
        first = plate + middle
        second = turned(plate, rng.uniform(-0.1, 0.1)) + middle + rng.uniform(-1.0, 1.0, 2) * H * rng.choice([0.3, 1.4])
        old, new = (sheets_at(grid, facets, x) for x in (first, second))
        values = np.full(old.node_count(degree), np.nan)
        nodes, side = sides(old, degree, first)
        values[nodes] = polynomial(old, degree, nodes, side)
        known = ~np.isnan(values)
        matrix = between(old, new, degree, along_surface(facets, second, H))
        nodes, side = sides(new, degree, second)
        assert not abs(matrix)[nodes][:, ~known].sum()
        found = (matrix @ np.where(known, values, 0.0))[nodes]
        assert np.abs(found - polynomial(new, degree, nodes, side)).max() < 1e-10, draw


def test_tip_that_goes_to_another_cell():
    """Nodes two cells from the plate keep their values, whichever of the facets near its end they see."""
    grid = uniform([0, 0], [2, 1], [20, 10])
    corners, facets = block([0.2, -0.015], [0.83, 0.015])
    part = np.linspace(0.0, 1.0, 40, endpoint=False)[:, None]
    plate = np.concatenate([a + part * (b - a) for a, b in corners[facets]])
    facets = np.stack([np.arange(len(plate)), np.roll(np.arange(len(plate)), -1)], axis=1)
    points = np.stack(np.unravel_index(np.arange(21 * 11), (21, 11), order="F"), axis=1) * H
    for draw in range(20):
        rng = np.random.default_rng(draw)
        first = turned(plate, rng.uniform(-0.2, 0.2)) + np.array([0.0, 0.52])
        second = first + rng.uniform(-0.05, 0.05, 2)
        old, new = (sheets_at(grid, facets, x) for x in (first, second))
        matrix = between(old, new, 1, along_surface(facets, second, H)).tocsr()
        far = np.flatnonzero(np.linalg.norm(points[:, None] - first, axis=2).min(axis=1) > 2.0 * H)
        assert np.array_equal(matrix[far].indices, far), draw


def test_tip_that_crosses_a_plane_to_and_fro():
    """Within a step: its sides share nodes from the second time on that it is across, and a new step forgets that."""
    grid = uniform([0, 0], [2, 1], [20, 10])
    plate, facets = block([0.23, 0.51], [1.3, 0.54])
    short, far = (Motion(plate + np.array([way, 0.0]), 0.0 * plate) for way in (-1e-5, 1e-5))
    bodies = [body("plate", plate, facets, motion=lambda x, t: (x, 0.0 * x))]
    thin, again = (ThinBodies(grid, bodies, (), None) for _ in range(2))
    before = [thin.sheets(facets, motion).node_count(1) for motion in (short, far)]
    assert before[1] > before[0]
    after = [thin.sheets(facets, motion).node_count(1) for motion in (short, far, short, far)]
    assert after == [before[0]] * 4
    again.restore(thin.save())
    assert again.sheets(facets, far).same_unknowns(thin.sheets(facets, far))
    for one in (thin, again):
        one.begin_step()
        assert one.sheets(facets, far).node_count(1) == before[1]


def test_the_place_at_the_start_of_a_step_is_no_iterate():
    """An end that goes over a plane and comes back once has not been there twice: its two sides stay parted."""
    grid = uniform([0, 0], [3, 1], [30, 10])
    plate, facets = block([0.23, 0.51], [1.3, 0.54])
    short, far = (Motion(plate + np.array([way, 0.0]), 0.0 * plate) for way in (-1e-5, 1e-5))
    thin = ThinBodies(grid, [body("plate", plate, facets, motion=lambda x, t: (x, 0.0 * x))], (), None)
    parted, joined = (thin.sheets(facets, motion).node_count(1) for motion in (far, short))
    thin.begin_step()
    thin.sheets(facets, far)
    thin.begin_step()
    counts = [thin.sheets(facets, motion).node_count(1) for motion in (far, short, far, short, far)]
    assert counts == [parted, joined, parted, joined, joined]


def test_body_that_becomes_thin_by_turning():
    """A plate of 4.5 cells, first parallel to the grid: the first position in a step decides, resumed or not."""
    grid = uniform([0, 0], [4, 4], [40, 40])
    plate, facets = block([-0.225, -1.5], [0.225, 1.5])
    straight, inclined = (Motion(turned(plate, angle) + 2.03, 0.0 * plate) for angle in (0.0, 0.8))
    bodies = [body("plate", plate, facets, motion=lambda x, t: (x, 0.0 * x))]
    thin, again = (ThinBodies(grid, bodies, (), None) for _ in range(2))
    assert [thin.sheets(facets, motion) for motion in (straight, inclined)] == [None, None]
    again.restore(thin.save())
    assert again.sheets(facets, inclined) is None
    for one in (thin, again):
        one.begin_step()
        assert one.sheets(facets, inclined).singles > 0
        assert one.sheets(facets, straight) is not None


@pytest.mark.parametrize("thick", [3.05, 5.6])
@pytest.mark.parametrize(("size", "thin"), [((0.0, 50.0), True), ((0.2, 50.0), False), ((8.0, 8.0), False)])
def test_which_bodies_are_looked_at(size, thin, thick):
    size = np.maximum(size, [np.floor(10.0 * thick) / 10.0 + size[0], 0.0])
    plate, facets = block([10.3, 10.3], 10.3 + size)
    assert may_be_thin(uniform([0, 0], [70, 70], [70, 70]), facets, plate, thick) == thin


@pytest.mark.parametrize("gap", [0.0, 0.01, 0.4])
def test_thick_bodies_side_by_side_are_not_thin(gap):
    """Between them is no solid; a plate beside them is thin, so is the wall of a ring, and halves that are tied."""
    grid, angles = uniform([0, 0], [70, 70], [70, 70]), 2.0 * np.pi * np.arange(48) / 48
    circle, ring = (
        np.stack([np.cos(angles), np.sin(angles)], axis=1),
        np.stack([np.arange(48), np.arange(1, 49) % 48], 1),
    )
    two = np.concatenate([[20.3, 20.4] + 8.0 * circle, [36.3 + gap, 20.6] + 8.0 * circle])
    plate, sides = block([20.0, 40.0], [30.0, 40.5])
    inner = [20.3, 20.4] + 7.0 * circle

    def thin(*surfaces, tied=None):
        counts = np.cumsum([0, *(len(x) for x, _ in surfaces)])
        facets = np.concatenate([own + first for (_, own), first in zip(surfaces, counts, strict=False)])
        x = np.concatenate([x for x, _ in surfaces])
        return may_be_thin(grid, facets, x, 3.05, solid_of(facets, x, tied))

    assert not thin((two[:48], ring), (two[48:], ring))
    assert thin((two[:48], ring), (two[48:], ring), (plate, sides))
    assert thin((two[:48], ring), (inner, ring[:, ::-1]))
    assert thin((two[:48], ring), (two[48:], ring), tied=np.arange(96) % 48 == 0)


@pytest.mark.parametrize("radius", [1.5, 2.0, 4.0])
def test_round_bodies_that_move_have_no_extra_cells(radius):
    """A disc of three cells and more, across several cells."""
    angles = 2.0 * np.pi * np.arange(24) / 24
    disc = 10.0 + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    facets = np.stack([np.arange(24), (np.arange(24) + 1) % 24], axis=1)
    disc = body("disc", disc, facets, motion=lambda x, t: (x + 0.37 * t, 0.0 * x + 0.37))
    patches = [Patch("box", ("x-", "x+", "y-", "y+"), "no_slip")]
    fluid = make_fluid(uniform([0, 0], [20, 20], [20, 20]), patches, [disc])
    for count in range(6):
        step(fluid, count, 1.0)
    assert fluid.renewals == 1
    assert fluid.grid.sheets is None


def leaf(element):
    """A slanted plate, thinner than a cell, that moves along a channel with one of its ends in the flow."""
    plate, facets = block([-0.01, -0.4], [0.01, 0.57])
    plate = turned(plate, 0.1) + np.array([0.5, 0.0])
    patches = [
        Patch("in", ("x-",), "traction", field(0.0, 0.0)),
        Patch("out", ("x+",), "outflow"),
        Patch("w", ("y-", "y+"), "slip"),
    ]
    way = np.array([0.7, 0.0])
    motion = lambda x, t: (x + way * t**2, 0.0 * x + 2.0 * way * t)  # noqa: E731
    return make_fluid(
        uniform([0, 0], [1.5, 1], [15, 10]), patches, [body("leaf", plate, facets, motion=motion)], mu=0.05,
        element=element, dt=0.1,
    )  # fmt: skip


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_resumed(element):
    """The cells of each side follow from where the bodies are: steps after a saved state are the same bit for bit."""
    fluid, again = (leaf(element) for _ in range(2))
    for number in range(3):
        step(fluid, 0.1 * number, 0.1)
    again.restore(scatter(fluid.comm, gather(fluid.comm, fluid.save()), again.save()))
    for number in (3, 4):
        for one in (fluid, again):
            step(one, 0.1 * number, 0.1)
    assert np.array_equal(fluid.flow, again.flow)
    assert fluid.renewals > 3


CASE = """\
time: {{step: 0.05, end: 0.1}}
fluid:
  density: 1
  viscosity: 0.02
  element: {element}
  grid: {{from: [0, 0], to: [1.5, 1], cells: [15, 10]}}
  patches:
    inlet: {{on: x-, traction: [0, 0]}}
    outlet: {{on: x+, outflow: true}}
    walls: {{on: [y-, y+], no_slip: true}}
  bodies:
    leaf:
      mesh: {{shape: rectangle, size: [0.02, 0.7], cells: [1, 7], origin: [0.61, 0.21], rotate: {{angle: 10}}}}
      motion: {{displacement: ["t^2", "0.3*t^2"]}}
probes:
  force: {{quantity: force, body: leaf}}
  before: {{quantity: pressure, at: [0.8, 0.57]}}
  behind: {{quantity: pressure, at: [0.4, 0.57]}}
  rate: {{quantity: flow_rate, through: outlet}}
  energy: {{quantity: kinetic_energy}}
  volume: {{quantity: volume}}
"""
COLUMNS = ("force.x", "force.y", "before", "behind", "rate", "energy", "volume", "fluid.mass")


@pytest.mark.slow
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_two_processes(tmp_path, element):
    """A plate with both ends in the flow, and a run that goes on with other processes; all probes follow it."""
    (tmp_path / "case.yaml").write_text(CASE.format(element=element))
    found = []
    for processes in (1, 2):
        out = tmp_path / str(processes)
        done = fsci("run", tmp_path, "-o", out, processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        done = fsci("resume", out, "--set", "time.end=0.2", processes=3 - processes)
        assert done.returncode == 0, done.stdout + done.stderr
        history = read_history(out / "history.csv")
        assert len(history["before"]) == 4
        found.append([history[name][-1] for name in COLUMNS])
    assert np.allclose(found[1], found[0], rtol=1e-8, atol=1e-10)
    assert abs(found[0][-1]) < 1e-12


PARTING = """\
time: {step: 0.05, end: 0.2}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  scheme: SCHEME
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    ends: {on: [x-, x+, y+], outflow: true}
    bottom: {on: y-, no_slip: true}
  bodies:
    left: {mesh: {shape: rectangle, size: [0.03, 0.9], cells: [1, 9], origin: [0.913, -0.2]}}
    right:
      mesh: {shape: rectangle, size: [0.03, 0.9], cells: [1, 9], origin: [0.938, -0.2]}
      motion: {displacement: ["0.4*max(t-0.1,0)", 0]}
probes:
  flow: {quantity: flow_rate, through: ends}
"""


@pytest.mark.parametrize("scheme", ["backward_euler", "bdf2"])
def test_plates_that_lie_on_each_other_and_part(tmp_path, scheme):
    """No fluid has been between them: it begins with their velocity. It comes in at the top, none through the box."""
    (tmp_path / "case.yaml").write_text(PARTING.replace("SCHEME", scheme))
    done = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    history = read_history(tmp_path / "out" / "history.csv")
    assert len(history["time"]) == 4  # no step is repeated
    assert abs(history["flow"][-1]) < 1e-9
    assert np.abs(history["fluid.mass"]).max() < 1e-9


STEADY = """\
time: {step: 1, end: 1}
fluid:
  density: 1
  viscosity: 0.1
  scheme: steady
  flow: FLOW
  element: ELEMENT
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    inlet: {on: x-, velocity: ["y*(1-y)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
  bodies:
    plate: {mesh: {shape: rectangle, size: [0.03, 0.5], cells: [1, 8], origin: ORIGIN}MOTION}
probes:
  force: {quantity: force, body: plate}
"""


@pytest.mark.parametrize(
    ("element", "flow"),
    [
        ("q1q1", "stokes"),
        ("q2q1", "navier_stokes"),
        *(pytest.param(*other, marks=pytest.mark.slow) for other in (("q1q1", "navier_stokes"), ("q2q1", "stokes"))),
    ],
)
def test_a_steady_flow_has_no_history(tmp_path, element, flow):
    """A thin plate that comes from seven cells away has the forces of one that has always been there."""
    found = []
    moves = (
        ', motion: {displacement: ["0.71*(1 - (1 - t)^2)", "0.13*(1 - (1 - t)^2)"]}'  # without a velocity at the end
    )
    for name, origin, motion in (("moved", "[0.213, 0.21]", moves), ("there", "[0.923, 0.34]", "")):
        text = STEADY.replace("ELEMENT", element).replace("FLOW", flow).replace("ORIGIN", origin)
        (tmp_path / "case.yaml").write_text(text.replace("MOTION", motion))
        done = fsci("run", tmp_path, "-o", tmp_path / name)
        assert done.returncode == 0, done.stdout + done.stderr
        history = read_history(tmp_path / name / "history.csv")
        found.append([history["force.x"][-1], history["force.y"][-1]])
    assert np.allclose(found[0], found[1], rtol=1e-7, atol=1e-9)
    assert found[1][0] > 0.1
