"""What is in a results folder is what was computed: its case.yaml, run again elsewhere, gives the same history."""

import shutil

import numpy as np
import pytest

import fsci.running.run as run
from fsci.case import load_case
from fsci.case.settings import settings_of
from fsci.running.history import read_history
from fsci.running.run import FAILED, FINISHED, resume_run, run_case

#: two bodies side by side, held on the left, under their weight
TWO = """\
time: {{step: 0.1, end: 0.2}}
{curves}
structure:
  bodies:
    a:
      mesh: {a}
      material: &soft {{law: neo_hooke, E: 1000, nu: 0.3, density: 1}}  # a comment
      supports: &held [{held}]
      gravity: &down [0, {load}]
    b: {{mesh: {b}, material: *soft, supports: *held, gravity: *down}}
probes:
  a: {{body: a, quantity: displacement, at: [2, 0]}}
  b: {{body: b, quantity: displacement, at: [2, 0]}}
"""
HELD = "{on: left, displacement: [0, 0]}"
POINTS = "{at: [0, 0], displacement: [0, 0]}, {at: [0, 1], displacement: [0, 0]}"
SHAPE = "{shape: rectangle, size: [2, 1], cells: [2, 1]}"


def grid(height=1.0, cells=2):
    """A rectangle of 2 x height with a row of cells."""
    import meshio

    x = np.linspace(0, 2, cells + 1)
    points = np.array([[a, b, 0] for b in (0, height) for a in x])
    n = np.arange(cells)
    quads = np.stack([n, n + 1, n + cells + 2, n + cells + 1], axis=1)
    return meshio.Mesh(points, [("quad", quads)], point_sets={"left": np.array([0, cells + 1])})


def write(path, content):
    import meshio

    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(content, str):
        path.write_text(content)
    elif path.suffix == ".xdmf":
        options = {"data_format": "Binary"} if "binary" in path.name else {}
        meshio.write(path, content, **options)
    else:
        meshio.write(path, content)


def two(a=SHAPE, b=SHAPE, held=HELD, load="-t", curves=""):
    return TWO.format(a=a, b=b, held=held, load=load, curves=curves)


BOX = """\
Point(1) = {0, 0, 0, h}; Point(2) = {2, 0, 0, h}; Point(3) = {2, 1, 0, h}; Point(4) = {0, 1, 0, h};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1}; Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
Physical Surface("all") = {1}; Physical Curve("left") = {4};
"""
CSV = "0, 0\n1, -1\n"

#: name -> (text of the case, files beside it, overrides)
CASES = {
    "a shared section": (two(), {}, [("structure.bodies.b.material.E", "5000")]),
    "the section that others share": (two(), {}, [("structure.bodies.a.material.E", "5000")]),
    "an entry of a shared list": (two(), {}, [("structure.bodies.b.gravity.1", "-3*t")]),
    "a merged section": (
        two().replace("*soft", "{<<: *soft, nu: 0.2}"),
        {},
        [("structure.bodies.a.material.E", "5000"), ("structure.bodies.b.supports.0.displacement.1", "0.1*t")],
    ),
    "meshes of one name": (
        two("{file: ../one/m.inp}", "{file: ../two/m.inp}"),
        {"../one/m.inp": grid(), "../two/m.inp": grid(0.5)},
        [],
    ),
    "names that differ in case only": (
        two("{file: m.inp}", "{file: M.inp}"),
        {"m.inp": grid(), "M.inp": grid(0.5)},
        [],
    ),
    "one mesh of two bodies": (two("&m {file: ../m.inp}", "*m"), {"../m.inp": grid()}, []),
    "XDMF": (
        two("{file: m.xdmf}", "{file: ../far/m.xdmf}", POINTS),
        {"m.xdmf": grid(), "../far/m.xdmf": grid(1.0, 3)},
        [],
    ),
    "XDMF with raw data": (two("{file: far/binary.xdmf}", SHAPE, POINTS), {"far/binary.xdmf": grid()}, []),
    "scripts that include others": (
        two("{file: a/box.geo}", "{file: ../b/box.geo}"),
        {
            "a/box.geo": 'Include "parts/sizes.txt";\n' + BOX,
            "a/parts/sizes.txt": 'Include "../../../common/h.txt";\n',
            "../b/box.geo": 'Include "../common/sizes/h.txt";\nInclude "../common/h.txt";\n' + BOX,
            "../common/h.txt": "h = 0.8;\n",
            "../common/sizes/h.txt": "h = 3;\n",
        },
        [],
    ),
    "a script with absolute names": (
        two("{file: box.geo}"),
        {"box.geo": 'Include "@/common/h.txt";\n' + BOX, "../common/h.txt": "h = 0.8;\n"},
        [],
    ),
    "options of a script": (
        two("{file: ../far/box.geo}"),
        {"../far/box.geo": "h = 2;\n" + BOX, "../far/box.geo.opt": "Mesh.MeshSizeFactor = 0.4;\n"},
        [],
    ),
    "Abaqus with a part": (
        two("{file: ../far/m.inp}", SHAPE, POINTS),
        {"../far/m.inp": "*HEADING\n*INCLUDE, INPUT=part.inp\n", "../far/part.inp": grid()},
        [],
    ),
    "absolute names": (
        two("{file: @/far/m.inp}", load="f(t)", curves="curves: {f: {csv: @/far/f.csv}}"),
        {"../far/m.inp": grid(), "../far/f.csv": CSV},
        [],
    ),
    **{
        f"a curve called {name}": (two(load="f(t)", curves=f"curves: {{f: {{csv: '{name}'}}}}"), {name: CSV}, [])
        for name in (
            *("history.csv", "History.CSV", "summary.json", "log.txt", "STOP", ".fsci-run", ".fsci-lock", "fields"),
            *("fields/x.csv", "checkpoint/a", "failure/case.yaml", "case.yaml.tmp", "data/history.csv", "meshes/a"),
        )
    },
    "a mesh called history.inp and a folder of results": (
        two("{file: pictures/m.inp}", "{file: meshes/b/m.inp}"),
        {"pictures/m.inp": grid(), "meshes/b/m.inp": grid(0.5)},
        [],
    ),
}


@pytest.fixture
def put(tmp_path):
    """Writes a case, with @ for the folder above its own, and its files."""

    def function(name):
        text, files, overrides = CASES[name]
        for file, content in files.items():
            if isinstance(content, str):
                content = content.replace("@", str(tmp_path / "home"))
            write(tmp_path / "home" / "case" / file, content)
        (tmp_path / "home" / "case").mkdir(parents=True, exist_ok=True)
        (tmp_path / "home" / "case" / "a case.yaml").write_text(text.replace("@", str(tmp_path / "home")))
        return load_case(tmp_path / "home" / "case" / "a case.yaml", overrides)

    return function


def assert_same(one, other):
    first, second = (read_history(folder / "history.csv") for folder in (one, other))
    assert list(first) == list(second)
    for name in first.keys() - {"wall"}:
        assert np.array_equal(first[name], second[name]), name


@pytest.mark.parametrize("name", CASES)
def test_the_case_in_the_results_is_the_one_computed(put, tmp_path, name):
    """Sources are gone and the folder is elsewhere: it is run again, and resumed."""
    out, moved = tmp_path / "out", tmp_path / "elsewhere" / "moved"
    case = put(name)
    assert run_case(case, out) == FINISHED
    assert settings_of(load_case(out)) == settings_of(case)
    assert "# a comment" in (out / "case.yaml").read_text()
    shutil.rmtree(tmp_path / "home")
    moved.parent.mkdir()
    out.rename(moved)
    assert run_case(load_case(moved), tmp_path / "again") == FINISHED
    assert_same(moved, tmp_path / "again")
    for folder in (moved, tmp_path / "again"):
        assert resume_run(folder, [("time.end", "0.3")]) == FINISHED
    assert_same(moved, tmp_path / "again")
    assert len(read_history(moved / "history.csv")["time"]) == 3


def test_a_body_and_an_obstacle_of_one_name(tmp_path):
    """Their meshes have one name, too, in two folders."""
    write(tmp_path / "a" / "m.inp", grid())
    below = grid(0.1)
    below.points[:, 1] -= 0.1
    below.point_sets["top"] = np.array([3, 4, 5])
    write(tmp_path / "b" / "m.inp", below)
    contact = """\
time: {step: 0.1, end: 0.2}
structure:
  bodies:
    w: {mesh: {file: ../a/m.inp}, material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}, gravity: [0, -t],
        supports: [{on: left, displacement: [0, 0]}]}
    v: {mesh: {shape: rectangle, size: [1, 1], cells: [1, 1], origin: [5, 0]},
        material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}, supports: [{on: left, displacement: [0, 0]}]}
contact:
  obstacles: {w: {mesh: {file: ../b/m.inp}, on: top}}
  pairs: {p: {slave: {body: v, on: bottom}, master: {obstacle: w}}}
probes: {volume: {body: w, quantity: volume}}
"""
    write(tmp_path / "case" / "case.yaml", contact)
    assert run_case(load_case(tmp_path / "case"), tmp_path / "out") == FINISHED
    assert resume_run(tmp_path / "out", [("time.end", "0.3")]) == FINISHED
    assert read_history(tmp_path / "out" / "history.csv")["volume"] == pytest.approx(2.0, rel=1e-2)


def test_a_mesh_that_changes_during_the_run(tmp_path, monkeypatch):
    """The run reads the copies, and the folder of a failure has them, too."""
    import meshio

    write(tmp_path / "case" / "m.inp", grid())
    write(tmp_path / "case" / "case.yaml", two("{file: m.inp}", load='"where(t > 0.15, -1e9, -t)"'))
    case = load_case(tmp_path / "case", [("time.retry.halvings", "0")])
    original = run.prepare_folder

    def then_changed(*arguments, **options):
        lock = original(*arguments, **options)
        write(tmp_path / "case" / "m.inp", grid(0.5))
        return lock

    monkeypatch.setattr(run, "prepare_folder", then_changed)
    assert run_case(case, tmp_path / "out") == FAILED
    for folder in (tmp_path / "out", tmp_path / "out" / "failure"):
        assert meshio.read(folder / "m.inp").points[:, 1].max() == 1.0
        assert load_case(folder).structure.bodies["a"].mesh.file == "m.inp"
