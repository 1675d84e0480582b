"""Tables along lines and surfaces: exact for linear fields, nan where nothing is, in the order of the outline."""

from dataclasses import replace

import numpy as np
import pytest

from fsci.cli import execute
from fsci.plot.along import loops_of, read_line
from fsci.plot.picture import plot_run
from fsci.running.output import FieldWriter
from fsci.running.results_folder import PICTURE_LIST
from solvers.api import Snapshot

HEXAHEDRON = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
SLOPES = np.array([[0.3, -1.0, 0.7], [0.4, 0.5, -0.2], [1.1, 0.6, -0.8]])


def flow_of(dim, cells=(5, 4, 3), factor=1.0):
    """A box of cells with linear velocity and pressure, times `factor`."""
    counts = [*cells[:dim], *[0] * (3 - dim)]
    index = np.arange(np.prod([n + 1 for n in counts])).reshape([n + 1 for n in counts])
    corners = HEXAHEDRON if dim == 3 else HEXAHEDRON[:4]
    nodes = [[index[i + a, j + b, k + c] for a, b, c in corners]
             for i, j, k in np.ndindex(*[max(n, 1) for n in counts])]  # fmt: skip
    points = np.stack(np.meshgrid(*[np.linspace(0, 1, n + 1) for n in counts], indexing="ij"), -1).reshape(-1, 3)
    fields = {"velocity": factor * points @ SLOPES.T, "pressure": factor * (1.0 + points @ SLOPES[0])}
    return Snapshot("fluid", points, np.array(nodes), "hexahedron" if dim == 3 else "quad", fields,
                    {"fluid_fraction": np.ones(len(nodes))})  # fmt: skip


def ring(name="disc", radius=0.25, corners=24):
    """A rigid body of the flow, with a traction."""
    angle = 2 * np.pi * np.arange(corners) / corners
    normal = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    facets = np.stack([np.arange(corners), (np.arange(corners) + 1) % corners], axis=1)
    return Snapshot(name, [0.5, 0.5, 0] + radius * normal, facets, "line", {"traction": -normal})


def cube(name="cube"):
    """A closed surface in space."""
    points = 0.3 + 0.4 * np.array(HEXAHEDRON, dtype=float)
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    return Snapshot(name, points, triangles, "triangle", {"traction": points})


def elastic():
    """A curved second-order cell with a displacement that is linear."""
    points = np.array([(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]) / 10 + [0.4, 0.4]
    points = np.pad(points, ((0, 0), (0, 1)))
    u = points @ SLOPES.T * [1, 1, 0]
    return Snapshot("block", points, np.arange(9)[None], "quad9", {"displacement": u, "velocity": 10 * u})


def written(tmp_path, *states):
    writer = FieldWriter(tmp_path / "fields")
    for step, parts in enumerate(states):
        writer.write(step, 0.5 * step, parts)
    return tmp_path


def table(path):
    data = np.genfromtxt(path, delimiter=",", names=True, deletechars="")
    return {name: data[name] for name in data.dtype.names}


@pytest.mark.parametrize("shift", [0.0, 1.0 / 15.0])
def test_linear_fields_are_exact_on_a_line_in_the_plane(tmp_path, shift):
    """At all times; what the rigid body covers is nan."""
    out = written(tmp_path, [flow_of(2), ring()], [flow_of(2, factor=2.0), ring()])
    line = f"0,{0.4 + shift}:1,{0.5 + shift}:41"
    drawn = plot_run(out, lines=[line])
    assert [path.name for path in drawn] == ["line_1.csv", "line_1_velocity.png", "line_1_pressure.png"]
    found = table(drawn[0])
    assert list(found)[:5] == ["time", "s", "x", "y", "z"]
    x = np.stack([found[axis] for axis in "xyz"], axis=1)
    assert np.array_equal(found["time"], np.repeat([0.0, 0.5], 41))
    assert found["s"] == pytest.approx(np.tile(np.linspace(0, 1, 41) * np.hypot(1, 0.1), 2))
    corner = 0.25 * np.cos(np.pi / 24)
    inside = np.linalg.norm(x - [0.5, 0.5, 0], axis=1)
    clear = np.abs(inside - 0.5 * (corner + 0.25)) > 0.25 - corner
    assert np.isnan(found["pressure"][clear & (inside < 0.25)]).all()
    there = clear & (inside > 0.25)
    factor = 1.0 + 2.0 * found["time"]
    assert found["pressure"][there] == pytest.approx((factor * (1.0 + x @ SLOPES[0]))[there], abs=1e-12)
    assert found["velocity.y"][there] == pytest.approx((factor * (x @ SLOPES[1]))[there], abs=1e-12)


def test_a_body_in_a_flow_has_its_own_values(tmp_path):
    out = written(tmp_path, [elastic(), flow_of(2)])
    (path, picture) = plot_run(out, lines=["0.1,0.51:0.9,0.51:81"], field="velocity.x")
    assert picture.name == "line_1_velocity.x.png"
    found = table(path)
    x = np.stack([found[axis] for axis in "xyz"], axis=1)
    body = (x[:, 0] > 0.401) & (x[:, 0] < 0.599)
    flow = (x[:, 0] < 0.399) | (x[:, 0] > 0.601)
    assert found["velocity.x"][flow] == pytest.approx((x @ SLOPES[0])[flow], abs=1e-12)
    assert found["velocity.x"][body] == pytest.approx(10 * (x @ SLOPES[0])[body], abs=1e-9)
    assert np.isnan(found["pressure"][body]).all()
    assert np.isnan(found["displacement.x"][flow]).all()


def test_a_line_in_space(tmp_path):
    out = written(tmp_path, [flow_of(3), cube()])
    found = table(plot_run(out, lines=["0.1,0.5,0.45:0.9,0.52,0.5:41"], field="vorticity.x")[0])
    x = np.stack([found[axis] for axis in "xyz"], axis=1)
    covered = np.all((x > 0.301) & (x < 0.699), axis=1)
    free = (x[:, 0] < 0.299) | (x[:, 0] > 0.701)
    assert np.isnan(found["pressure"][covered]).all()
    assert found["pressure"][free] == pytest.approx((1 + x @ SLOPES[0])[free], abs=1e-12)
    assert found["vorticity.x"][free] == pytest.approx(SLOPES[2, 1] - SLOPES[1, 2], abs=1e-9)


def test_the_surface_of_a_rigid_body(tmp_path):
    """Its length is that of the polygon, its first point stands at the end again."""
    out = written(tmp_path, [flow_of(2), ring()])
    names = ["surface_disc.csv", "surface_disc_traction.png"]
    drawn = plot_run(out, surfaces=["disc"], field="traction")
    assert [path.name for path in drawn] == names
    found = table(drawn[0])
    edge = 2 * 0.25 * np.sin(np.pi / 24)
    assert found["s"] == pytest.approx(edge * np.arange(25))
    assert found["traction.x"] == pytest.approx(-(found["x"] - 0.5) / 0.25)
    assert set((out / "pictures" / PICTURE_LIST).read_text().split()) == set(names)


def test_shear_along_a_surface_has_a_sign(tmp_path):
    """A shear along x over a ring: forwards along s below, where s runs to the right, backwards above."""
    disc = ring()
    shear = np.zeros((len(disc.points), 3))
    shear[:, 0] = 2.0
    disc = replace(disc, point_data={**disc.point_data, "wall_shear_stress": shear})
    found = table(plot_run(written(tmp_path, [flow_of(2), disc]), surfaces=["disc"], field="wall_shear_stress")[0])
    assert found["wall_shear_stress.s"] == pytest.approx(-2.0 * (found["y"] - 0.5) / 0.25, abs=1e-12)
    two = np.array([3, 4, 5, 3, 7, 8, 9, 7])
    assert [(loop.start, loop.stop) for loop in loops_of(two)] == [(0, 4), (4, 8)]


def test_the_surface_of_an_elastic_body_goes_over_midnodes(tmp_path):
    found = table(plot_run(written(tmp_path, [elastic()]), surfaces=["block"])[0])
    assert found["s"] == pytest.approx(np.arange(9) / 10)
    assert found["x"] == pytest.approx(0.4 + np.array([0, 0.1, 0.2, 0.2, 0.2, 0.1, 0, 0, 0]))
    assert found["y"] == pytest.approx(0.4 + np.array([0, 0, 0, 0.1, 0.2, 0.2, 0.2, 0.1, 0]))


def test_a_surface_in_space_is_a_table_of_its_points(tmp_path):
    (path,) = plot_run(written(tmp_path, [flow_of(3), cube()]), surfaces=["cube"])
    found = table(path)
    assert len(found["x"]) == 8
    assert found["traction.z"] == pytest.approx(found["z"])


def test_mistakes_in_lines_and_surfaces(tmp_path, capsys):
    out = written(tmp_path, [flow_of(2), ring()])
    for text in ("0,0", "0,0:1", "0,0:0,0", "0,0:1,0:1", "a,0:1,0", "0:1", "0,0:1,nan"):
        with pytest.raises(ValueError, match=f"a line is BEGIN:END or BEGIN:END:POINTS, .*, not '{text}'"):
            read_line(text)
    with pytest.raises(ValueError, match="there is no body 'disk'; there are disc, fluid"):
        plot_run(out, surfaces=["disk"])
    known = "pressure, velocity.x, velocity.y, velocity.z"
    with pytest.raises(ValueError, match=f"no part has a field 'stress' there; there are {known}"):
        plot_run(out, lines=["0,0:1,0"], field="stress")
    assert execute(["plot", str(out), "--line", "-0.5,0.1:1,0.1:4", "--field", "pressure"]) == 0
    assert capsys.readouterr().out.split() == [str(out / "pictures" / n) for n in ("line_1.csv", "line_1_pressure.png")]
    assert np.isnan(table(out / "pictures/line_1.csv")["pressure"]).tolist() == [True, False, False, False]
