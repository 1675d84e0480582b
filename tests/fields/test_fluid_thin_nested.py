"""Thin bodies in nested cells: the fluid on one side does not know of that on the other."""

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, solve_steady, step, turned
from programs import fsci
from thin_space import duct, plate

from fsci.running.history import read_history
from solvers.fluid.flow.probes import at_point
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.following import Following, RefinedBody
from solvers.fluid.grid.nested import RefinedBox, RefinedSurface, refined
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
@pytest.mark.parametrize(
    ("element", "levels"), [("q1q1", 1), ("q2q1", 1), ("q1q1", 2), pytest.param("q2q1", 2, marks=pytest.mark.slow)]
)
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


@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow)])
def test_plate_that_closes_a_duct(element):
    """In 3D, at rest and moved by 0.4 cells per step."""
    grid = refined(uniform([0, 0, 0], [4.0, 0.75, 0.75], [8, 2, 2]), [RefinedBox([0, 0, 0], [2.6, 0.75, 0.75], 1)])
    points, facets, normal = plate(0.02, np.random.default_rng(3))
    points, speed = points + np.array([0.2, 0.0, 0.0]), np.array([0.5, 0.0, 0.0])
    fluid = duct([body("plate", points, facets)], element, (2.0, 0.7), grid=grid, scheme="steady")
    solve_steady(fluid)
    force = 1.3 * 0.75**2 / normal[0] * normal
    assert np.abs(fluid.flow[fluid.unknowns.velocity.dofs]).max() < 1e-9
    assert np.abs(fluid.force()["plate"].sum(axis=0) - force).max() < 1e-8
    moved = body("plate", points, facets, motion=lambda x, t: (x + t * speed, 0.0 * x + speed))
    fluid = duct([moved], element, (1.0, 0.7), grid=grid, mu=0.05, dt=0.2, initial_velocity=field(0.5, 0.0, 0.0))
    for number in range(3):
        step(fluid, 0.2 * number, 0.2)
        nodes = fluid.unknowns.velocity.dofs
        velocity = fluid.flow[nodes][fluid.system.active_dofs[nodes[:, 0]]]
        assert np.abs(velocity - speed).max() < 1e-9


def pushed(thickness, element, following, number, size=0.0625, dt=0.1):
    """A plate that seals a channel and moves along it, the flow with it; largest errors of velocity and force.

    The angle is such that both its ends are outside of the box. following: cells follow it.
    """
    angle, pressures = 0.21, (1.0, 0.7)
    speed, along = 0.9 * size / dt, np.array([1.0, 0.0])
    points, facets = block([-thickness * size / 2, -1.5], [thickness * size / 2, 1.5])
    points, box = turned(points, angle) + np.array([1.37, 0.51]), uniform([0, 0], [3, 1], [24, 8])
    patches = [
        Patch("in", ("x-",), "traction", field(pressures[0], 0.0)),
        Patch("out", ("x+",), "traction", field(-pressures[1], 0.0)),
        Patch("w", ("y-", "y+"), "slip"),
    ]
    moved = body(
        "plate", points, facets, motion=lambda x, t: (x + speed * t * along, 0.0 * x + speed * along)
    )  # fmt: skip
    around = RefinedSurface(points, facets, 4, 1) if following else RefinedBox([0.6, 0.0], [2.4, 1.0], 1)
    rule = Following(box, [], [RefinedBody("plate", 4, 1)]) if following else None
    fluid = make_fluid(
        refined(box, [around]), patches, [moved], element=element, mu=0.05, dt=dt,
        initial_velocity=field(speed, 0.0), following=rule,
    )  # fmt: skip
    force = (pressures[0] - pressures[1]) / np.cos(angle) * np.array([np.cos(angle), np.sin(angle)])
    off, grids = np.zeros(2), set()
    for count in range(number):
        step(fluid, count * dt, dt)
        nodes = fluid.unknowns.velocity.dofs
        velocity = fluid.flow[nodes][fluid.system.active_dofs[nodes[:, 0]]]
        error = np.abs(velocity - speed * along).max(), np.abs(fluid.force()["plate"].sum(axis=0) - force).max()
        off = np.maximum(off, error)
        grids.add(fluid.grid.nested.first.tobytes())
        assert fluid.grid.sheets is not None
    return off, len(grids)


@pytest.mark.parametrize(
    "thickness", [pytest.param(1e-3, marks=pytest.mark.slow), 0.2, pytest.param(1.0, marks=pytest.mark.slow), 3.0]
)
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_plate_that_moves_along_a_channel(element, thickness):
    """Nothing passes it, and it carries the difference of the pressures in each step, also where it enters cells."""
    off, _ = pushed(thickness, element, following=False, number=4)
    assert (off < 1e-9).all()


@pytest.mark.parametrize(
    ("element", "thickness"),
    [
        ("q1q1", 1e-3),
        ("q2q1", 1.0),
        *(pytest.param(*some, marks=pytest.mark.slow) for some in (("q1q1", 1.0), ("q2q1", 1e-3))),
    ],
)
def test_cells_follow_a_plate(element, thickness):
    """The same where its cells go with it."""
    off, grids = pushed(thickness, element, following=True, number=7)
    assert (off < 1e-9).all()
    assert grids > 2


CASE = """\
time: {{step: 0.05, end: 0.1}}
fluid:
  density: 1
  viscosity: 0.02
  element: {element}
  grid: {{from: [0, 0], to: [1.6, 1], cells: [8, 5], refine: [{refine}]}}
  patches:
    inlet: {{on: x-, traction: [0, 0]}}
    outlet: {{on: x+, outflow: true}}
    walls: {{on: [y-, y+], no_slip: true}}
  bodies:
    leaf:
      mesh: {{shape: rectangle, size: [0.02, 0.4], cells: [1, 4], origin: [0.61, 0.31], rotate: {{angle: 10}}}}
      motion: {{displacement: ["4*t^2", "0.3*t^2"]}}
probes:
  force: {{quantity: force, body: leaf}}
  before: {{quantity: pressure, at: [0.8, 0.57]}}
  behind: {{quantity: pressure, at: [0.4, 0.57]}}
  rate: {{quantity: flow_rate, through: outlet}}
  section: {{quantity: flow_rate, plane: {{point: [0.63, 0.5], normal: [1, 0]}}}}
  energy: {{quantity: kinetic_energy}}
  volume: {{quantity: volume}}
"""
COLUMNS = ("force.x", "force.y", "before", "behind", "rate", "section", "energy", "volume", "fluid.mass")
BOXED, FOLLOWED = "{box: [[0, 0], [1.4, 1]], level: 1}", "{around: leaf, layers: 4, level: 2}"


def results(folder, element, refine, processes, resumed):
    (folder / "case.yaml").write_text(CASE.format(element=element, refine=refine))
    out = folder / f"{processes}{resumed}"
    done = fsci("run", folder, "-o", out, processes=processes)
    assert done.returncode == 0, done.stdout + done.stderr
    done = fsci("resume", out, "--set", "time.end=0.2", processes=resumed)
    assert done.returncode == 0, done.stdout + done.stderr
    history = read_history(out / "history.csv")
    assert len(history["before"]) == 4
    return history


@pytest.mark.parametrize(
    "refine", [pytest.param(BOXED, id="boxed", marks=pytest.mark.slow), pytest.param(FOLLOWED, id="followed")]
)
@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow)])
def test_two_processes(tmp_path, element, refine):
    """A plate with both ends in the flow, and a run that goes on with other processes; all probes follow it."""
    one, two = (results(tmp_path, element, refine, *counts) for counts in ((1, 2), (2, 1)))
    for name in COLUMNS:
        assert np.allclose(one[name], two[name], rtol=1e-8, atol=1e-10), name
    assert np.abs(one["fluid.mass"]).max() < 1e-12
