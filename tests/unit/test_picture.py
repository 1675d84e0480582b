"""Pictures against geometry known beforehand: what is where, in which colour, how curved, in which units."""

from __future__ import annotations

import math

import numpy as np
import pytest
from PIL import Image

from fsci.plot import movie
from fsci.plot.curves import contact_panels, plot_history
from fsci.plot.magnify import magnified
from fsci.plot.mirror import Mirror
from fsci.plot.picture import plot_run, read_series
from fsci.plot.render import BARE, DRY, axes_of_view, frame, import_pyvista, load_body, render
from fsci.plot.render_flow import load_state
from fsci.plot.scene import compose
from fsci.plot.units import label
from fsci.running.history import HistoryWriter
from fsci.running.output import FieldWriter, write_text, write_vtu
from fsci.running.summary import write_summary
from solvers.api import Snapshot

SI = {"length": "m", "mass": "kg", "time": "s"}
QUAD9 = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]


def bent_beam(curvature: float, cells: int = 6) -> Snapshot:
    """A cantilever of length 1 and height 0.1 bent to a circle, quad9."""
    s, eta = np.meshgrid(np.linspace(0, 1, 2 * cells + 1), [-0.05, 0.0, 0.05], indexing="ij")
    radius = 1 / curvature
    x = np.stack([(radius - eta) * np.sin(curvature * s), radius - (radius - eta) * np.cos(curvature * s), 0 * s], -1)
    index = np.arange(s.size).reshape(s.shape)
    nodes = np.array([[index[2 * cell + i, j] for i, j in QUAD9] for cell in range(cells)])
    displacement = (x - np.stack([s, eta, 0 * s], -1)).reshape(-1, 3)
    return Snapshot("flag", x.reshape(-1, 3), nodes, "quad9", {"displacement": displacement, "level": eta.ravel()})


def square(cell_type: str, bulge: float = 0.0) -> Snapshot:
    """The unit square as one cell; its upper edge bulges to a parabola; u = (x, 0)."""
    points = np.array([(i / 2, j / 2, 0.0) for i, j in QUAD9])
    points[6, 1] += bulge
    points = points if cell_type == "quad9" else points[:4]
    u = points * [1, 0, 0]
    return Snapshot("square", points, np.arange(len(points))[None], cell_type, {"u": u, "v": -u[:, 0]})


@pytest.fixture
def draw(tmp_path):
    """Draws a snapshot onto 200 x 200 pixels; returns the picture and a function from position to pixel."""

    def drawn(snapshot: Snapshot, field: str):
        write_vtu(tmp_path / "body.vtu", snapshot)
        body = load_body(tmp_path / "body.vtu", field)
        view = frame(np.eye(3), np.array([-0.5, -0.5, 0.0]), np.array([1.5, 1.5, 0.0]), aspect=1.0)
        pixels = render([body], view, size=(200, 200), limits=(0.0, 1.0), colours="gray")
        scale = 200 / (1.08 * 2)
        return lambda x, y: pixels[round(100 - (y - 0.5) * scale), round(100 + (x - 0.5) * scale)]

    return drawn


def test_values_have_their_colour_and_place(draw):
    at = draw(square("quad"), "u")
    assert np.all(at(-0.05, 0.5) == 255)
    assert np.all(at(0.5, 1.05) == 255)
    for x in (0.1, 0.25, 0.5, 0.9):
        assert at(x, 0.4) == pytest.approx(np.full(3, 255 * x), abs=4)
    assert np.all(at(0.5, 0.0) < 50), "the outline is black"


def test_components_and_bodies_without_the_field(draw):
    assert draw(square("quad"), "u.x")(0.5, 0.4) == pytest.approx(np.full(3, 127), abs=4)
    assert draw(square("quad"), "u.y")(0.5, 0.4) == pytest.approx(np.zeros(3), abs=4)
    assert draw(square("quad"), "temperature")(0.5, 0.4) == pytest.approx(np.full(3, 211), abs=4)


def test_second_order_cells_are_curved(draw):
    at = draw(square("quad9", bulge=0.3), "u")
    parabola = 1 + 0.3 * 4 * 0.25 * 0.75
    assert at(0.25, parabola - 0.03)[0] < 200
    assert np.all(at(0.25, parabola + 0.03) == 255)


def test_edges_are_those_of_the_cells(tmp_path):
    lattice = np.stack(np.meshgrid([0.0, 1, 2], [0.0, 1, 2], [0.0, 1, 2], indexing="ij"), -1).reshape(-1, 3)
    index = np.arange(27).reshape(3, 3, 3)
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.array([[index[i + a, j + b, k + c] for a, b, c in corners] for i, j, k in np.ndindex(2, 2, 2)])
    write_vtu(tmp_path / "cube.vtu", Snapshot("cube", lattice, cells, "hexahedron", {}))
    cube = load_body(tmp_path / "cube.vtu", "u")
    assert len(cube.edges) == 48
    assert len(cube.outline) == 0

    write_vtu(tmp_path / "square.vtu", square("quad9", bulge=0.3))
    edges = load_body(tmp_path / "square.vtu", "u").outline
    assert len(edges) == 4
    assert min(np.linalg.norm(edge - [0.5, 1.3, 0.0], axis=1).min() for edge in edges) < 1e-6


def test_the_view_frames_everything(tmp_path):
    write_vtu(tmp_path / "square.vtu", square("quad"))
    scene = compose([[load_body(tmp_path / "square.vtu", "v")]], "v", "", SI)
    assert scene.flat
    assert scene.view.half_height == pytest.approx(0.54)
    assert scene.view.centre == pytest.approx([0.5, 0.5, 0])
    assert scene.limits == (-1.0, 0.0)
    axes = axes_of_view(False)
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[2, 1] > 0, "z points up"


def test_an_unknown_field_is_an_error_that_names_the_known_ones(tmp_path):
    write_vtu(tmp_path / "square.vtu", square("quad"))
    with pytest.raises(ValueError, match=r"'pressure'; there are u, v"):
        compose([[load_body(tmp_path / "square.vtu", "pressure")]], "pressure", "", SI)


def test_units():
    assert label("u", "displacement", SI) == "u [m]"
    assert label("v", "velocity", {**SI, "length": "mm"}) == "v [mm/s]"
    assert label("a", "acceleration", SI) == "a [m/s$^2$]"
    assert label("f", "reaction", SI) == "f [N]"
    assert label("f", "reaction", {"length": "mm", "mass": "kg", "time": "s"}) == "f [kg mm/s$^2$]"
    assert label("p", "pressure", {"length": "mm", "mass": "t", "time": "s"}) == "p [MPa]"
    assert label("my_level", "level", SI) == "my level"


def test_a_run_is_drawn_from_its_folder(tmp_path, monkeypatch):
    from PIL import Image

    monkeypatch.setattr(movie, "find_encoder", lambda: None)  # of another test

    fields = FieldWriter(tmp_path / "fields")
    history = HistoryWriter(tmp_path / "history.csv")
    for step in range(3):
        fields.write(step, 0.1 * step, [bent_beam(0.5 * step + 0.01)])
        motion = {"A.x": 0.0, "A.y": math.sin(step), "energy": 1.0}
        history.write(step, 0.1 * step, 0.1, 3, 0.0, motion)
    write_text(tmp_path / "case.yaml", "title: Flag\nprobes: {A: {quantity: displacement, at: [0.6, 0.2]}}\n")
    write_summary(tmp_path / "summary.json", {"newton": {"residuals": {"1": [1.0, 1e-3, 1e-9]}}})
    drawn = plot_run(tmp_path, movie=True)
    names = [
        "final_displacement.png",
        "mesh.png",
        "movie.gif",
        "history_A.png",
        "history_energy.png",
        "convergence.png",
    ]
    assert [path.relative_to(tmp_path / "pictures").as_posix() for path in drawn] == names
    for path in drawn:
        picture = Image.open(path)
        if path.suffix == ".gif":
            assert (picture.n_frames, picture.size) == (3, (960, 600))
        else:
            assert picture.size == (1600, 400 if path.name == "mesh.png" else 1000), "a straight beam is long"
        colours = np.asarray(picture.convert("RGB")).reshape(-1, 3)
        assert np.all(colours[0] == 255), "the background is white"
        coloured = np.mean(np.ptp(colours.astype(int), axis=1) > 60) > 1e-3
        assert coloured == (path.name != "mesh.png"), "something coloured is there"


def test_displacements_times_a_factor(tmp_path):
    """Twice the displacement of a bent beam, points and title; true scale beside a flow and along lines."""
    beam = bent_beam(0.01)
    write_vtu(tmp_path / "flag.vtu", beam)
    (((time, file),),) = magnified([[(0.5, tmp_path / "flag.vtu")]], 3.0, tmp_path)
    assert (time, file.name) == (0.5, "flag.vtu")
    drawn = import_pyvista().read(file)
    assert np.allclose(drawn.points, beam.points + 2.0 * beam.point_data["displacement"], rtol=0, atol=1e-6)
    flow = Snapshot("flow", beam.points, beam.cells, "quad9", {}, {"fluid_fraction": np.ones(len(beam.cells))})
    write_vtu(tmp_path / "flow.vtu", flow)
    with pytest.raises(ValueError, match="beside a flow are drawn at true scale: leave --scale out"):
        magnified([[(0.5, tmp_path / "flow.vtu")]], 3.0, tmp_path)
    with pytest.raises(ValueError, match="along lines and surfaces have no scale: leave --scale out"):
        plot_run(tmp_path, scale=2.0, lines=["0,0:1,0"])


def test_a_dry_side_is_pale_and_under_the_bodies(tmp_path):
    """Lines around a dry side, and an obstacle on it."""
    lines = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    around = np.array([(0.0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    fields = FieldWriter(tmp_path / "fields")
    obstacle = Snapshot("a", 0.25 + 0.5 * around, lines, "line", {})
    for step in range(2):
        fields.write(step, 0.1 * step, [Snapshot("side", around, lines, "line", {}, {"dry": np.ones(4)}), obstacle])
    side, above = read_series(tmp_path / "fields", Mirror([], tmp_path))
    assert (side[0][1].name, above[0][1].name) == ("side_000000.vtu", "a_000000.vtu")
    parts = load_state([side[0][1], above[0][1]], "displacement")
    assert [part.colour for part in parts] == [DRY, BARE]
    view = frame(np.eye(3), np.zeros(3), np.array([1.0, 1.0, 0.0]), aspect=1.0)
    pixels = render(parts, view, size=(108, 108), limits=(0.0, 1.0), colours="gray")
    assert (pixels[54, 54] < 220).all()
    assert (pixels[54, 12] > 235).all()


def test_states_at_times(tmp_path):
    fields = FieldWriter(tmp_path / "fields")
    for step in range(3):
        fields.write(step, 0.1 * step, [bent_beam(0.5 * step + 0.01)])
    drawn = plot_run(tmp_path, times=(0.12, 7.0))
    assert [path.name for path in drawn] == ["displacement_0.1.png", "displacement_0.2.png"]
    with pytest.raises(ValueError, match="no fields"):
        plot_run(tmp_path / "fields", times=(0.1,))


def test_balances_and_contact_are_a_picture_each(tmp_path):
    time = np.linspace(0, 1, 40)
    history = {"time": time, "structure.energy": -1e-6 * time, "fluid.mass": 0 * time, "contact.active": np.round(time)}
    history |= {f"contact.wall.{axis}": time for axis in "xyz"}
    history |= {"contact.friction": 2.0 * time, "contact.on_ball.x": 1e-4 * time}
    drawn = plot_history(tmp_path, history, {}, SI)
    assert [path.name for path in drawn] == ["history_contact.png", "history_balances.png"]
    panels = contact_panels(history, SI)
    assert {label: list(curves) for label, curves in panels.items()} == {
        "contact force of wall [N]": ["x", "y", "z"],
        "work of friction [J]": [""],
        "contact force on ball [N]": ["x"],
        "contact nodes": ["active"],
    }


def test_many_bodies_in_contact(tmp_path):
    """Panels stand in columns; bodies that touch nothing have none, unless none of them touches anything."""
    time = np.linspace(0, 1, 40)
    history = {"time": time} | {f"contact.on_{name}.x": (name != "c") * time for name in "abcdefghijklmno"}
    (drawn,) = plot_history(tmp_path, history, {}, SI)
    with Image.open(drawn) as picture:
        assert picture.size == (3 * 1600, 2200)  # 14 panels in 3 columns of 5
    assert "contact force on c [N]" not in contact_panels(history, SI)
    still = {name: 0.0 * values for name, values in history.items()}
    assert len(contact_panels(still, SI)) == 15


def test_a_broken_off_run_without_fields_or_summary_is_drawn(tmp_path):
    writer = HistoryWriter(tmp_path / "history.csv")
    for step in (1, 2):
        writer.write(step, 0.1 * step, 0.1, 3, 0.0, {"A": 1.0})
    assert [path.name for path in plot_run(tmp_path)] == ["history_A.png"]


def test_one_step_is_no_curve(tmp_path):
    """Steady runs have a value, not a history."""
    assert plot_history(tmp_path, {"time": np.ones(1), "A.x": np.ones(1)}, {}, SI) == []


def test_columns_of_the_program_have_terms_and_units(tmp_path, monkeypatch):
    """A count that is zero in all steps has no picture."""
    texts = []
    monkeypatch.setattr("fsci.plot.curves.plot_curves", lambda path, *rest: texts.append(rest[-1]) or path)
    history = {"time": np.arange(3.0), "interface.power": np.ones(3), "coupling.linear": np.zeros(3)}
    assert [path.name for path in plot_history(tmp_path, history, {}, SI)] == ["history_interface.png"]
    plot_history(tmp_path, history | {"coupling.linear": np.arange(3.0)}, {}, SI)
    assert texts == ["power of the fluid on the bodies [W]"] * 2 + ["linear iterations in a step"]


def test_components_of_very_different_range_get_their_own_axis(tmp_path):
    from PIL import Image

    time = np.linspace(0, 1, 50)
    history = {"time": time, "A.x": 1e-3 * np.sin(9 * time), "A.y": np.sin(9 * time)}
    (path,) = plot_history(tmp_path, history, {}, SI)
    colours = np.asarray(Image.open(path).convert("RGB")).astype(int)
    blue = np.flatnonzero((colours[..., 2] - colours[..., 0] > 120).sum(axis=1) > 0)
    assert np.ptp(blue) > 300, "the small component fills its axis"
