"""`fsci check` reads meshes: what it accepts a run starts with, what it refuses a run refuses with the same words."""

from inspect import unwrap

import meshio  # noqa: TID253
import numpy as np
import pytest
from case_mistakes import load, refused
from case_text import with_section, without

from fsci import shapes
from fsci.case import load_case
from fsci.check.check import summary
from fsci.check.meshes import check_meshes, is_hollow, thickness
from fsci.cli import execute
from fsci.running.run import FINISHED, run_case
from solvers.mesh.mesh import Mesh

SOLID = """\
title: two blocks from files
time: {step: 1, end: 1}
structure:
  bodies:
    lower:
      mesh: {file: block.inp}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: bottom, displacement: [0, 0]}]
    upper:
      mesh: {file: block.inp, translate: [0, 1.001]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: top, displacement: [0, -0.01]}]
contact:
  pairs:
    meet: {slave: {body: upper, on: bottom}, master: {body: lower, on: top}}
probes:
  middle: {quantity: displacement, body: upper, at: [0.5, 1.5]}
"""
FLOW = """\
title: flow past a file
time: {step: 1, end: 1}
fluid:
  density: 1
  viscosity: 1
  flow: stokes
  scheme: steady
  grid: {from: [0, 0], to: [4, 2], cells: [16, 8]}
  patches:
    west: {on: x-, velocity: [1, 0]}
    east: {on: x+, outflow: true}
    rest: {on: [y-, y+], slip: true}
  bodies:
    block: {mesh: {file: block.inp, translate: [1.01, 0.51]}}
probes:
  wake: {quantity: velocity, at: [3, 1]}
"""


@pytest.fixture(autouse=True)
def _files(tmp_path, monkeypatch):
    """A square with named sides, the same with 8-node cells, and cells of two types."""
    monkeypatch.chdir(tmp_path)
    square = shapes.rectangle((1, 1), (3, 3))
    write("block.inp", square)
    full = shapes.rectangle((1, 1), (3, 3), order=2)
    used, cells = np.unique(full.cells[:, :8], return_inverse=True)
    named = {name: np.searchsorted(used, facets) for name, facets in full.surfaces.items()}
    write("serendipity.inp", Mesh(full.points[used], cells.reshape(-1, 8), "quad8", named))
    mixed = [("quad", [[0, 1, 2, 3]]), ("triangle", [[1, 4, 2]])]
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]], dtype=float)
    meshio.Mesh(corners, mixed).write("mixed.vtu")


def write(name, mesh):
    """A file with named surfaces as sets of points."""
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    named = {key: np.unique(facets) for key, facets in mesh.surfaces.items()}
    meshio.Mesh(points, [(mesh.cell_type, mesh.cells)], point_sets=named).write(name)


@pytest.mark.parametrize("case", [SOLID, FLOW], ids=["solid", "flow"])
def test_what_check_accepts_runs(case, capsys):
    loaded = load(case)
    found = check_meshes(loaded)
    assert (found.problems, found.notes) == ([], [])
    if case is SOLID:
        assert "block.inp, neo_hooke, 9 cells (quad)" in summary(loaded, found.meshes)
        assert "64" in summary(loaded, found.meshes)
    assert run_case(loaded, loaded.folder / "out") == FINISHED


#: the case, what is replaced, by what, the message with line and column
MISTAKES = [
    (SOLID, "file: block.inp}", "file: mixed.vtu}", "6:13: mixed.vtu: the cells are quad and triangle; all must be of"),
    (
        SOLID,
        "on: bottom, disp",
        "on: botom, disp",
        "8:23: unknown surface, line or points 'botom'; did you mean 'bottom'?",
    ),
    (SOLID, "lower, on: top", "lower, on: tip", "15:72: unknown surface 'tip'; did you mean 'top'?"),
    (SOLID, "0.5, 1.5]", "0.5, 2.5]", "17:53: the point (0.5, 2.5) is not in body 'upper'"),
    (SOLID, "0.5, 1.5]", "0.5, 1.5, 0]", "17:53: 'at' has 3 entries, but the mesh is of 2 dimensions"),
    (
        SOLID,
        "file: block.inp}",
        "file: block.inp}\n      region: core",
        "7:15: unknown region 'core' (available: none)",
    ),
    (FLOW, "block.inp", "mixed.vtu", "14:19: mixed.vtu: the cells are quad and triangle; all must be of one type"),
    (FLOW, "1.01, 0.51]}}", "1.01, 0.51]}, on: [left, right]}", "14:67: these surfaces do not enclose the body"),
    (FLOW, "at: [3, 1]", "at: [1.5, 1]", "16:34: there is no fluid at (1.5, 1.0): the point is in body 'block'"),
    (FLOW, "slip: true", "where: x - 1, slip: true", "9:3: no patch is on part of the box's boundary: y-, y+"),
]


@pytest.mark.parametrize(("case", "old", "new", "message"), MISTAKES, ids=[m[3] for m in MISTAKES])
def test_check_says_what_a_run_says(case, old, new, message, capsys):
    assert case.count(old) >= 1
    error = refused(case.replace(old, new, 1), lambda case: run_case(case, case.folder / "out"))
    assert execute(["check", "case.yaml"]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"case.yaml:{message}")
    assert str(error) in said


def test_obstacles_are_read():
    contact = "contact:\n  obstacles:\n    floor: {mesh: {file: serendipity.inp, translate: [0, -1]}, on: top}\n"
    case = SOLID.replace("contact:\n", contact).replace("{body: lower, on: top}", "{obstacle: floor}")
    found = check_meshes(load(case))
    assert (found.problems, len(found.notes)) == ([], 1)
    said = check_meshes(load(case.replace("-1]}, on: top", "-1]}, on: tip"))).problems
    assert str(said[0]).startswith("case.yaml:15:68: unknown surface 'tip'; did you mean 'top'?")


def test_symmetry_on_a_curve():
    """Of a built-in shape, too."""
    disc = "mesh: {shape: disc, radius: 0.5, cells: [12, 1]}\n      material: {law: neo_hooke, E: 1, nu: 0}"
    body = f"    lower:\n      {disc}\n      supports: [{{on: outer, symmetry: true}}]\n"
    case = with_section(SOLID, body, "structure", "bodies", "lower")
    for path in (("contact",), ("probes",), ("structure", "bodies", "upper")):
        case = without(case, *path)
    found = check_meshes(load(case))
    assert [str(p).split("\n")[0] for p in found.problems] == [
        "case.yaml:8:18: a plane of symmetry must be plane, but this surface is curved; take 'normal: true'"
    ]


def test_completed_cells_are_mentioned(capsys):
    case = SOLID.replace("block.inp", "serendipity.inp", 1)
    with open("case.yaml", "w", encoding="utf-8") as file:
        file.write(case)
    words = "its quad8 cells became quad9: nodes were added in the middle of cells and faces"
    assert execute(["check", "case.yaml"]) == 0
    assert f"note: case.yaml:6:13: {words}" in capsys.readouterr().err
    assert run_case(load_case("case.yaml"), load_case("case.yaml").folder / "out") == FINISHED
    assert f"mesh of body 'lower': {words}" in capsys.readouterr().out


def test_bodies_against_the_grid():
    write("short.inp", shapes.rectangle((1, 0.3), (3, 1)))
    write("plate.inp", shapes.rectangle((2, 0.3), (6, 1)))
    short, plate = (FLOW.replace("block.inp", f"{name}.inp") for name in ("short", "plate"))
    said = check_meshes(load(short)).warnings[0]
    assert said.startswith("case.yaml:14:19: the body is 0.3 thick, 1.2 of the smallest cells"), (
        "both sides share nodes"
    )
    assert "thick" not in " ".join(check_meshes(load(plate)).warnings), "it rests: it may be as thin as it likes"
    assert "thick" not in " ".join(check_meshes(load(plate.replace("slip: true", "periodic: true"))).warnings)
    found = check_meshes(load(FLOW.replace("[1.01, 0.51]", "[5, 0]")))
    assert found.warnings == ["case.yaml:14:12: the body is outside of the fluid's box"]


@pytest.mark.parametrize(
    ("mesh", "least"),
    [
        (shapes.rectangle((3, 0.2), (6, 2)), 0.2),
        (shapes.disc(0.7, [64, 4]), 1.4),
        (shapes.box((1, 2, 3), (2, 2, 2)), 1.0),
        (shapes.box((5, 5, 0.1), (2, 2, 1)), 0.1),
    ],
)
def test_thickness(mesh, least):
    assert thickness(mesh) == pytest.approx(least, rel=0.01)


def test_a_ball_is_as_thick_as_wide():
    assert thickness(shapes.sphere(0.5, [8, 2], order=2)) == pytest.approx(1.0, rel=0.05)


def test_what_encloses_a_space_is_hollow():
    """By the surface of a mesh, and by the names of a shape's surfaces."""
    assert is_hollow(shapes.ring(1, 2, [12, 2]))
    assert is_hollow(shapes.hollow_sphere(1, 2, [2, 1], order=2))
    assert not is_hollow(shapes.ring(1, 2, [12, 2], 300))
    assert not is_hollow(shapes.tube(1, 2, 1, [12, 1, 2]))
    for shape, arguments, hollow in (("ring", (1, 2, [12, 2]), True), ("tube", (1, 2, 1, [12, 1, 2]), False)):
        assert unwrap(getattr(shapes, shape))(*arguments).hollow == hollow
