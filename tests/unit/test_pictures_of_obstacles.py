"""Obstacles are written where they are and drawn beside the bodies; pictures say what the largest pressure was."""

from dataclasses import replace

import numpy as np
import pytest
from case_mistakes import load

from fsci.builder.obstacles import obstacle_snapshots
from fsci.plot.picture import Labels, largest_pressure, plot_pressure, plot_run
from fsci.plot.render import import_pyvista
from fsci.plot.render_flow import load_state
from fsci.plot.scene import AROUND, compose
from fsci.running.output import FieldWriter, write_vtu
from solvers.api import Snapshot

UNITS_OF_CASE = {"length": "m", "mass": "kg", "time": "s"}
SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
OBSTACLES = """\
time: {step: 0.5, end: 1}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [1, 1]}
      material: {law: neo_hooke, E: 1, nu: 0, density: 1}
      supports: [{on: bottom, displacement: [0, 0]}]
contact:
  obstacles:
    punch: {mesh: {shape: rectangle, size: [2, 1], cells: [2, 1], origin: [0, 1]}, on: bottom, motion: ["t", "-0.1*t"]}
    floor: {mesh: {shape: rectangle, size: [9, 1], cells: [1, 1], origin: [0, -1]}, on: top}
    block: {mesh: {shape: rectangle, size: [9, 1], cells: [1, 1], origin: [0, -1]}, on: top}
  pairs:
    punch: {slave: {body: block, on: top}, master: {obstacle: punch}}
"""


@pytest.mark.usefixtures("in_new_folder")
def test_obstacles_are_where_their_motion_puts_them():
    """Whole and closed, apart from one that is called as a body."""
    punch, floor = obstacle_snapshots(load(OBSTACLES))(0.5)
    assert (punch.name, floor.name) == ("punch", "floor")
    assert np.allclose([punch.points.min(axis=0), punch.points.max(axis=0)], [[0.5, 0.95, 0], [2.5, 1.95, 0]])
    assert np.allclose([floor.points.min(axis=0), floor.points.max(axis=0)], [[0, -1, 0], [9, 0, 0]])
    lengths = np.linalg.norm(np.diff(punch.points[punch.cells], axis=1), axis=2)
    assert punch.cell_type == "line"
    assert lengths.sum() == pytest.approx(6.0)


def block(pressure=0.0):
    fields = {"displacement": np.zeros((4, 3)), "contact_pressure": pressure * np.array([0, 0, 1.0, 0.5])}
    fields["contact_traction"] = np.stack([0 * SQUARE[:, 0], -fields["contact_pressure"], 0 * SQUARE[:, 0]], axis=1)
    return Snapshot("block", SQUARE, np.arange(4)[None], "quad", fields)


def outline(size, name="floor"):
    points = SQUARE * [size, size, 0] - [0.0, size, 0]
    return Snapshot(name, points, np.array([[0, 1], [1, 2], [2, 3], [3, 0]]), "line", {})


@pytest.mark.parametrize("size", [0.1, 1e3])
def test_an_obstacle_of_any_size_does_not_decide_on_the_view(tmp_path, size):
    for part in (block(), outline(size)):
        write_vtu(tmp_path / f"{part.name}.vtu", part)
    state = load_state([tmp_path / "block.vtu", tmp_path / "floor.vtu"], "displacement")
    assert [part.aside for part in state] == [False, True]
    view = compose([state], "displacement", "", UNITS_OF_CASE).view
    room = min(size, AROUND)
    assert view.half_height == pytest.approx(0.54 * (1 + room))
    assert view.centre[1] == pytest.approx(0.5 - room / 2)


def test_the_largest_contact_pressure_and_its_time(tmp_path, monkeypatch):
    titles = []
    monkeypatch.setattr(
        "fsci.plot.picture.plot_pressure", lambda path, moment, labels: titles.append(labels.title) or path
    )
    fields = FieldWriter(tmp_path / "fields")
    for step, pressure in enumerate([0.0, 2500.0, 1000.0]):
        fields.write(step, 0.25 * step, [block(pressure), outline(2.0)])
    assert "final_contact_pressure.png" in [path.name for path in plot_run(tmp_path)]
    assert titles == [f"{tmp_path.name}, largest 2.5 kPa at 0.25 s"]
    assert largest_pressure(((0.0, tmp_path / "fields/floor_000001.vtu"),)) == 0.0


def test_contact_pressure_is_drawn_beside_what_presses(tmp_path, monkeypatch):
    """In the plane; what touches a body in space would hide it."""
    drawn = []
    monkeypatch.setattr("fsci.plot.picture.compose", lambda states, *rest, **more: drawn.extend(states[0]))
    monkeypatch.setattr("fsci.plot.picture.draw", lambda *rest, **more: None)
    monkeypatch.setattr("fsci.plot.picture.save_figure", lambda figure, path: None)
    files = []
    for part in (block(2500.0), outline(2.0)):
        write_vtu(tmp_path / f"{part.name}.vtu", part)
        files.append((0.0, tmp_path / f"{part.name}.vtu"))
    plot_pressure(tmp_path / "p.png", tuple(files), Labels("title"))
    assert [(part.aside, part.values is None) for part in drawn] == [(True, True), (False, False)]


PLACES = ((1.0, 1.0), (0.3, 1.7), (1.7, 0.3), (0.0, 2.0), (-0.5, 2.5))


@pytest.mark.parametrize(
    ("computed", "shift", "half"),
    [
        *((1.0, *place) for place in PLACES[:3]),
        *((-1.0, *place) for place in PLACES[3:]),
        *(pytest.param(1.0, *place, marks=pytest.mark.slow) for place in PLACES[3:]),
        *(pytest.param(-1.0, *place, marks=pytest.mark.slow) for place in PLACES[:3]),
    ],
)
def test_an_obstacle_across_a_plane_of_symmetry_has_two_sides(tmp_path, monkeypatch, shift, half, computed):
    """Those of the side that was computed; bodies may not be across."""
    seen = []
    monkeypatch.setattr("fsci.plot.picture.load_state", lambda *args: seen.append(load_state(*args)) or seen[-1])
    fields = FieldWriter(tmp_path / "fields")
    body, floor = block(), outline(2.0)
    places = (body.points, floor.points - [shift, 0.0, 0.0])
    parts = [replace(part, points=x * [computed, 1, 1]) for part, x in zip((body, floor), places, strict=True)]
    fields.write(0, 0.0, parts)
    drawn = plot_run(tmp_path, times=(0.0,), mirrors=("x=0",))
    assert [path.name for path in drawn] == ["displacement_0.png"]
    (part,) = [part.surface for part in seen[0] if part.aside]
    assert part.bounds[:4] == pytest.approx([-half, half, -2.0, 0.0])
    with pytest.raises(ValueError, match="a part lies on both sides"):
        plot_run(tmp_path, times=(0.0,), mirrors=(f"x={0.5 * computed}",))


def test_obstacles_in_a_flow_in_space_do_not_hide_it(tmp_path):
    """A large floor: its part in the box, behind the slice. A stamp in the box is whole, one before it is not drawn."""
    pyvista = import_pyvista()
    box = pyvista.ImageData(dimensions=(5, 5, 5), spacing=(0.5, 0.25, 0.25)).cast_to_unstructured_grid()
    box.point_data["velocity"] = np.tile([1.0, 0.0, 0.0], (box.n_points, 1))
    box.cell_data["fluid_fraction"] = np.ones(box.n_cells)
    box.save(tmp_path / "fluid.vtu")
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    places = {"floor": (10.0, [-4.0, -4.0, 0.3]), "stamp": (0.2, [0.5, 0.1, 0.5]), "near": (2.0, [0.0, -2.5, 0.5])}
    for name, (size, start) in places.items():
        points = size * SQUARE + start
        points[2] += [0.0, 0.0, 1e-3 * size]  # else it would be a drawing in a plane
        write_vtu(tmp_path / f"{name}.vtu", Snapshot(name, points, triangles, "triangle", {}))
    state = load_state([tmp_path / f"{name}.vtu" for name in ("fluid", *places)], "velocity")
    floor, stamp = [part.surface for part in state if part.aside]
    assert floor.bounds[:4] == pytest.approx([0.0, 2.0, 0.5, 1.0], abs=1e-5)
    assert stamp.bounds[:4] == pytest.approx([0.5, 0.7, 0.1, 0.3])
    assert compose([state], "velocity", "", UNITS_OF_CASE).view.half_height > 0.0
