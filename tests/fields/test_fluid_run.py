"""Flows run as a user runs them: measured, resumed bit for bit, on two processes, with files and pictures."""

import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from programs import fsci

from fsci import shapes
from fsci.case import CaseError, load_case
from fsci.case.fluid import Movement
from fsci.case.rigid_motion import rigid_motion
from fsci.meshes.mesh import place
from fsci.plot.picture import plot_run
from fsci.plot.scene import UPRIGHT
from fsci.running.history import read_history
from fsci.running.output import read_collection
from fsci.running.run import FINISHED, run_case
from solvers.fluid.surfaces.inside import winding
from solvers.fluid.surfaces.surface import Motion
from solvers.mesh.tessellation import is_closed, tessellate, unit_normals, vertex_shares

MOVING = """\
title: a paddle turns and sways beside a ball
time: {step: 0.02, end: 0.12}
fluid:
  density: 2
  viscosity: 0.05
  element: q1q1
  grid: {from: [0, 0], to: [2, 1], cells: [30, 15]}
  patches:
    walls: {on: [x-, x+, y-, y+], no_slip: true}
  bodies:
    paddle:
      mesh: {shape: rectangle, size: [0.5, 0.1], origin: [0.75, 0.45], cells: [10, 2]}
      motion:
        displacement: ["0.2*sin(2*pi*t)", 0]
        rotation: {centre: [1, 0.5], angle: "40*sin(2*pi*t)"}
    ball:
      mesh: {shape: disc, radius: 0.1, cells: [16, 1], translate: [0.3, 0.5]}
probes:
  paddle: {quantity: force, body: paddle}
  ball: {quantity: force, body: ball}
  moment: {quantity: moment, body: paddle, about: [1, 0.5]}
  aside: {quantity: velocity, at: [1, 0.65]}
  covered: {quantity: pressure, at: [1.22, 0.58]}
  dp: {quantity: pressure, at: [0.1, 0.5], minus: [1.9, 0.5]}
  across: {quantity: flow_rate, plane: {point: [1, 0.5], normal: [1, 0.3]}}
  driven: {quantity: power, body: paddle}
  energy: {quantity: kinetic_energy}
  power: {quantity: dissipation}
  volume: {quantity: volume}
output: {fields_every: 3}
"""

#: a flow that the elements contain: velocity (2, 1), pressure from the body force
LINEAR = """\
title: a linear flow round a body that moves with it
time: {step: 0.05, end: 0.1}
fluid:
  density: 2
  viscosity: 0.5
  element: q1q1
  flow: stokes
  grid: {from: [0, 0], to: [1, 2], cells: [5, 8]}
  patches:
    west: {on: x-, velocity: [2, 1]}
    east: {on: x+, velocity: [2, 1]}
    rest: {on: [y-, y+], velocity: [2, 1]}
    top: {on: y+, where: x - 0.5, traction: [0, "-(4*x + 2*y + 4)"]}
  body_force: [4, 2]
  gravity: [0, 0]
  initial_velocity: [2, 1]
  bodies:
    square:
      mesh: {shape: rectangle, size: [0.3, 0.3], origin: [0.31, 0.72], cells: [1, 1]}
      motion: {displacement: [2*t, t]}
probes:
  u: {quantity: velocity, at: [0.9, 1.77]}
  p: {quantity: pressure, at: [0.13, 0.41]}
  force: {quantity: force}
  drag: {quantity: drag_coefficient, body: square, reference: {velocity: 0.5, length: 0.3, density: 4, drag: [0, 2]}}
  lift: {quantity: lift_coefficient, reference: {velocity: 0.5, length: 0.3, drag: [3, 4]}}
  moment: {quantity: moment}
  out: {quantity: flow_rate, through: east}
  upright: {quantity: flow_rate, plane: {point: [0.6, 1], normal: [3, 0]}}
  slanted: {quantity: flow_rate, plane: {point: [0.66, 0.97], normal: [-1, -1]}}
  gain: {quantity: power}
  mean: {quantity: pressure, on: west}
  energy: {quantity: kinetic_energy}
  power: {quantity: dissipation}
  volume: {quantity: volume}
"""


def run(text, folder, *overrides):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml", overrides), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    """The run of the moving paddle: (results folder, history)."""
    folder = tmp_path_factory.mktemp("moving")
    return folder / "out", run(MOVING, folder)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_probes_of_a_flow_known_in_closed_form(element, tmp_path):
    """Uniform velocity, p = 4 x + 2 y + 4: force, moment, means and energies from geometry alone."""
    history = run(LINEAR, tmp_path, ("fluid.element", element))
    final = {name: values[-1] for name, values in history.items()}
    volume, centre = 2 - 0.09, np.array([0.31 + 0.15 + 0.2, 0.72 + 0.15 + 0.1])
    expected = {
        "u.x": 2,
        "u.y": 1,
        "p": 4 * 0.13 + 2 * 0.41 + 4,
        "force.x": -4 * 0.09,
        "force.y": -2 * 0.09,
        "drag": -2 * 0.09 / (0.5 * 4 * 0.5**2 * 0.3),
        "lift": (-4 * -0.8 - 2 * 0.6) * 0.09 / (0.5 * 2 * 0.5**2 * 0.3),
        "moment": 0.09 * (-2 * centre[0] + 4 * centre[1]),
        "out": 4,
        "upright": 2 * (2 - 0.3),
        "slanted": -3 / np.sqrt(2) * (np.sqrt(2) - 0.3 * np.sqrt(2)),  # along a diagonal of the square
        "gain": -4 * 0.09 * 2 - 2 * 0.09 * 1,
        "mean": 6,
        "energy": 0.5 * 2 * 5 * volume,
        "power": 0,
        "volume": volume,
        "fluid.mass": 0,
        "fluid.leak": 0,
    }
    for name, value in expected.items():
        assert final[name] == pytest.approx(value, abs=1e-9), name


def test_what_a_moving_body_does(moving):
    _, history = moving
    box = 2 - 0.05 - 0.5 * 16 * 0.01 * np.sin(2 * np.pi / 16)
    assert np.allclose(history["volume"], box, rtol=1e-13)
    assert np.abs(history["fluid.mass"]).max() < 1e-13
    assert history["paddle.x"][0] < 0 < -history["paddle.x"][0], "the fluid holds the paddle back"
    assert np.all(history["power"] > 0)
    assert np.isnan(history["covered"][-1])
    assert not np.isnan(history["covered"][0])


def test_files_of_a_flow(moving):
    import pyvista

    out, history = moving
    flow, paddle = (read_collection(out / "fields" / f"{name}.pvd") for name in ("fluid", "paddle"))
    assert [time for time, _ in flow] == pytest.approx([0, 0.06, 0.12])
    mesh = pyvista.read(flow[-1][1])
    assert set(mesh.point_data) == {"velocity", "pressure"}
    fraction = mesh.cell_data["fluid_fraction"]
    assert fraction.max() == 1
    assert 0 < fraction.min() < 1
    assert fraction @ np.full(len(fraction), 2 / 450) == pytest.approx(history["volume"][-1])
    surface = pyvista.read(paddle[-1][1])
    shift = 0.2 * np.sin(2 * np.pi * 0.12)
    assert np.allclose(surface.points.mean(axis=0), [1 + shift, 0.5, 0], atol=1e-6)
    area, _ = vertex_shares(surface.points[:, :2].astype(float), surface.cells.reshape(-1, 3)[:, 1:])
    force = area @ surface.point_data["traction"]
    assert force[0] == pytest.approx(history["paddle.x"][-1], rel=1e-5)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["dofs"] == {"fluid": 3 * 31 * 16}
    assert summary["balances"]["fluid.mass"]["max_abs"] < 1e-13


def test_pictures_of_a_flow(moving, tmp_path):
    """Velocity with streamlines and pressure by default; bodies are grey and on top of the flow."""
    from PIL import Image

    out, _ = moving
    shutil.copytree(out / "fields", tmp_path / "fields")
    names = ["final_velocity.png", "final_pressure.png", "mesh.png", "story_velocity.png"]
    assert [path.name for path in plot_run(tmp_path)] == names
    with pytest.raises(ValueError, match="no body has a field 'displacement'"):
        plot_run(tmp_path, field="displacement")
    pixels = np.asarray(Image.open(tmp_path / "pictures" / "final_pressure.png").convert("RGB")).astype(int)
    left, bottom, width, height = UPRIGHT[0]
    scale = 1600 * width / 2.16  # pixels per metre: the box is 2 m wide and has a margin of 4 %

    def at(x, y):
        centre = (1600 * (left + width / 2), 1000 * (1 - bottom - height / 2))
        return pixels[round(centre[1] - (y - 0.5) * scale), round(centre[0] + (x - 1) * scale)]

    grey = [211, 211, 211]
    assert np.all(at(0.3, 0.5) == grey)
    assert np.all(at(1 + 0.2 * np.sin(2 * np.pi * 0.12), 0.5) == grey)
    assert np.any(at(0.3, 0.75) != grey)
    assert np.all(at(0.3, 1.1) == 255)
    colours = np.unique(np.round(pixels[300:700, 300:1200].reshape(-1, 3) / 8), axis=0)
    assert len(colours) > 20, "a colour map, not one colour"


def test_a_resumed_flow_is_the_same_bit_for_bit(moving, tmp_path):
    _, whole = moving
    (tmp_path / "case.yaml").write_text(MOVING)
    half = load_case(tmp_path / "case.yaml", [("time.end", "0.06")])
    assert run_case(half, tmp_path / "out") == FINISHED
    text = (tmp_path / "out" / "case.yaml").read_text()
    (tmp_path / "out" / "case.yaml").write_text(text.replace("end: 0.06", "end: 0.12"))
    done = fsci("resume", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    resumed = read_history(tmp_path / "out" / "history.csv")
    for name in whole.keys() - {"wall"}:
        assert np.array_equal(whole[name], resumed[name], equal_nan=True), name


@pytest.mark.slow
def test_two_processes(moving, tmp_path):
    _, one = moving
    (tmp_path / "case.yaml").write_text(MOVING)
    done = fsci("run", tmp_path, "-o", tmp_path / "out", processes=2)
    assert done.returncode == 0, done.stdout + done.stderr
    two = read_history(tmp_path / "out" / "history.csv")
    for name in one.keys() - {"wall", "residual", "fluid.mass"}:
        assert np.allclose(one[name], two[name], rtol=1e-8, atol=1e-9, equal_nan=True), name


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("at: [1, 0.65]", "at: [1, 0.5]", "22:35: there is no fluid at (1.0, 0.5): the point is in body 'paddle'"),
        (
            "{on: [x-, x+, y-, y+], no_slip: true}",
            "{on: [x-, x+, y-, y+], where: x - 1, no_slip: true}",
            "8:3: no patch is on part of the box's boundary: x-, y-, y+",
        ),
        (
            "cells: [10, 2]}",
            "cells: [10, 2]}\n      on: [left, right]",
            "13:11: these surfaces do not enclose the body: name all of them",
        ),
    ],
)
def test_mistakes_that_only_meshes_show(old, new, message, tmp_path):
    (tmp_path / "case.yaml").write_text(MOVING.replace(old, new))
    with pytest.raises(CaseError) as caught:
        run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out")
    assert str(caught.value).startswith(f"{tmp_path}/case.yaml:{message}")


# ---------------------------------------------------------------------------------------------- surfaces and motions


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("cell", ["hex", "tet"])
def test_tessellated_ball(cell, order):
    """Closed, outward, on the sphere, with a volume by the divergence theorem that converges to the ball's."""
    mesh = shapes.sphere(1, (6, 1), order=order, cell=cell)
    facets, nodes = tessellate(mesh)
    x = mesh.points[nodes]
    assert is_closed(facets)
    assert np.array_equal(facets, tessellate(mesh, ["outer"])[0])
    assert np.allclose(np.linalg.norm(x, axis=1), 1)
    corners = x[facets]
    assert np.all(np.einsum("mi,mi->m", unit_normals(x[facets]), corners.mean(axis=1)) > 0.9)
    assert np.linalg.det(corners).sum() / 6 == pytest.approx(4 * np.pi / 3, rel=0.06 / order**2)


def test_an_open_surface_is_not_closed():
    mesh = shapes.box((1, 1, 1), (2, 2, 2))
    assert not is_closed(tessellate(mesh, ["left", "top"])[0])
    assert not is_closed(tessellate(shapes.rectangle((1, 1), (2, 2)), ["left", "top"])[0])


@pytest.mark.parametrize("dim", [2, 3])
def test_winding_number(dim):
    """1 inside, 0 outside, between them on the surface, its edges and corners."""
    mesh = shapes.rectangle((1, 1), (3, 3)) if dim == 2 else shapes.box((1, 1, 1), (3, 3, 3))
    facets, nodes = tessellate(mesh)
    motion = Motion(mesh.points[nodes], 0 * mesh.points[nodes])
    assert winding(np.full(dim, 0.4), motion, facets) == pytest.approx(1)
    assert winding(np.full(dim, 1.4), motion, facets) == pytest.approx(0, abs=1e-12)
    for point in ([0.5, 0, 0.5], [0, 1 / 3, 0.2], [1, 1, 1], [0.7, 1.0, 0.1]):
        assert -1e-9 < winding(np.array(point[:dim]), motion, facets) < 1 - 1e-6


@pytest.mark.parametrize("dim", [2, 3])
def test_rigid_motion(dim):
    """Positions as placed meshes have them; velocities against differences of positions."""
    points = np.random.default_rng(1).random((5, dim))
    centre, axis = [0.3, -0.2, 0.5][:dim], {} if dim == 2 else {"axis": [1, 2, -1]}
    settings = {
        "displacement": ["t^2", "sin(t)", "1"][:dim],
        "rotation": {"centre": centre, "angle": "30*t + 5*t^3", **axis},
    }
    motion = rigid_motion(points, Movement.model_validate(settings), 0.0, 0.01)
    t, h = 0.7, 1e-5
    rotation = SimpleNamespace(axis=axis.get("axis"), angle=30 * t + 5 * t**3)
    mesh = SimpleNamespace(points=points - centre)
    expected = _placed(mesh, rotation) + centre + np.array([t**2, np.sin(t), 1])[:dim]
    x, v = motion(t)
    assert np.allclose(x, expected, atol=1e-13)
    difference = (motion(t + h)[0] - motion(t - h)[0]) / (2 * h)
    assert np.allclose(v, difference, atol=1e-8)


@pytest.mark.parametrize("dim", [2, 3])
def test_rigid_motion_by_velocities(dim):
    """The same motion by its rates: positions and velocities agree, in any order of times."""
    points = np.random.default_rng(1).random((5, dim))
    about = {"centre": [0.3, -0.2, 0.5][:dim], **({} if dim == 2 else {"axis": [1, 2, -1]})}
    by_values = {
        "displacement": ["(t - 1)^2 + 1/2 + max(t - 1.5, 0)", "sin(t) - sin(1)", "0"][:dim],
        "rotation": {"angle": "30*(t - 1) + 5*(t^3 - 1)", **about},
    }
    by_rates = {
        "velocity": ["2*(t - 1) + (t > 1.5)", "cos(t)", "0"][:dim],
        "rotation": {"angular_velocity": "30 + 15*t^2", **about},
    }
    start, dt = 1.0, 0.25
    exact, found = (rigid_motion(points, Movement.model_validate(s), start, dt) for s in (by_values, by_rates))
    for t in (2.3, 1.0, 1.2, 7.9, 1.75):
        assert np.allclose(found(t)[0] + np.eye(dim)[0] / 2, exact(t)[0], rtol=0.0, atol=1e-13)
        assert np.allclose(found(t)[1], exact(t)[1], atol=1e-8)


def _placed(mesh, rotation):
    from solvers.mesh.mesh import Mesh

    return place(Mesh(mesh.points, np.zeros((0, 3), dtype=int), "triangle"), rotation).points
