"""`fsci sweep` and `fsci diff`: a bar whose stretch is known, what fails, what is not run twice."""

import csv
import json

import pytest
from programs import fsci

from fsci.case import load_case
from fsci.diff import diff
from fsci.running.history import HistoryWriter
from fsci.sweep.picture import draw
from fsci.sweep.points import Combination, Parameter, between_commas, parameters, points, short_names

pytestmark = pytest.mark.usefixtures("runs_in_copies")

#: Small strains without lateral contraction: the end moves by p L / E.
BAR = """
time: {step: 0.5, end: 1}
structure:
  bodies:
    bar:
      mesh: {shape: rectangle, size: [2, 1], cells: [2, 1]}
      material: {law: st_venant_kirchhoff, E: 1, nu: 0}
      supports: [{on: left, displacement: [0, 0]}]
      tractions: [{on: right, value: [1e-9*t, 0]}]
probes: {end: {body: bar, quantity: displacement, at: [2, 1]}}
verify:
  - {value: end.x, reference: 2e-9, relative: 10}
"""
E = "structure.bodies.bar.material.E"
WIDTH = "structure.bodies.bar.mesh.size"


def sweep(folder, *settings, text=BAR, code=0):
    (folder / "case.yaml").write_text(text)
    ended = fsci("sweep", folder, "-o", folder / "out", *(f"--set={setting}" for setting in settings))
    assert ended.returncode == code, ended.stdout + ended.stderr
    return ended


def rows_of(folder):
    with (folder / "out" / "sweep.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def words(text):
    return [line.split() for line in text.splitlines()]


def test_values_divide_at_commas_outside_of_brackets_and_quotes():
    assert list(between_commas('1e3, [2, 3],"a, b",max(x, 1),{c: 4, d: 5}')) == [
        "1e3", "[2, 3]", '"a, b"', "max(x, 1)", "{c: 4, d: 5}",
    ]  # fmt: skip


def test_settings_with_one_value_are_no_parameters():
    several, single = parameters([("a.b", "1,2"), ("c", "3"), ("d", "[4, 5]"), ("e", "6,6")])
    assert several == [Parameter("a.b", ("1", "2"))]
    assert single == (("c", "3"), ("d", "[4, 5]"), ("e", "6,6"))


def test_names_are_as_short_as_they_may_be():
    assert short_names(["structure.bodies.a.material.E", "fluid.viscosity"]) == ["E", "viscosity"]
    assert short_names(["x.a.material.E", "x.b.material.E"]) == ["a.material.E", "b.material.E"]
    assert [point.name for point in points([Parameter("a.E", ("1e3", "2")), Parameter("b", ("[0, 1]", "x/y"))])] == [
        "E=1e3,b=0_1", "E=1e3,b=x_y", "E=2,b=0_1", "E=2,b=x_y",
    ]  # fmt: skip
    long = points([Parameter("a", ("x" * 200, "x/y", "x y"))])
    assert [point.name for point in long] == ["run_1", "a=x_y", "run_3"]


def test_a_bar_in_four_ways(tmp_path):
    """Young's modulus by length: p L / E each, in the table, the file and on the screen; a second time nothing runs."""
    ended = sweep(tmp_path, f"{E}=1,4", f"{WIDTH}=[2, 1],[1, 1]", "probes.end.at=null", "probes.end.on=right")
    rows = rows_of(tmp_path)
    assert [(row["E"], row["size"], row["status"]) for row in rows] == [
        ("1", "[2, 1]", "finished"), ("1", "[1, 1]", "finished"),
        ("4", "[2, 1]", "finished"), ("4", "[1, 1]", "finished"),
    ]  # fmt: skip
    assert [float(row["end.x"]) for row in rows] == pytest.approx([2e-9, 1e-9, 5e-10, 2.5e-10], rel=1e-5)
    assert "2e-09" in ended.stdout
    assert (tmp_path / "out" / "sweep_end.png").stat().st_size > 10_000
    histories = sorted((tmp_path / "out").glob("*/history.csv"))
    assert len(histories) == 4
    times = [path.stat().st_mtime_ns for path in histories]
    sweep(tmp_path, f"{E}=1,4,2", f"{WIDTH}=[2, 1],[1, 1]", "probes.end.at=null", "probes.end.on=right")
    assert [path.stat().st_mtime_ns for path in histories] == times
    assert len(rows_of(tmp_path)) == 6


def test_a_run_that_fails_has_its_message_and_others_their_values(tmp_path):
    """Compression far beyond a Saint Venant-Kirchhoff bar's limit, and a value that the case refuses."""
    ended = sweep(tmp_path, "structure.bodies.bar.tractions.0.value=[1e-9*t, 0],[-9*t, 0],[0, 0, 0]", code=1)
    rows = rows_of(tmp_path)
    assert [row["status"] for row in rows] == ["finished", "failed", "failed"]
    assert [bool(row["end.x"]) for row in rows] == [True, False, False]
    found = json.loads((tmp_path / "out" / "sweep.json").read_text())["messages"]
    assert "failed with dt" in found[rows[1]["run"]]
    assert "'value' must have 2 entries in 2D, not 3" in found[rows[2]["run"]]
    assert "failed with dt" in ended.stdout


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ([f"{E}=1"], "give at least one setting several values: --set fluid.viscosity=1,2,3"),
        ([f"{E}=1,2", f"{E}=3"], f"'{E}' is given twice: write --set {E}=1,2"),
        (["structure.bodies.bar.material.F=1,2"], "F"),
    ],
)
def test_what_cannot_be_swept(tmp_path, settings, message):
    ended = sweep(tmp_path, *settings, code=2)
    assert message in ended.stderr
    assert not (tmp_path / "out").exists()


def test_diff_names_settings_files_and_changes(tmp_path):
    (tmp_path / "force.csv").write_text("0,0\n1,1e-9\n")
    curve = "curves: {f: {csv: force.csv}}\n" + BAR.replace("1e-9*t", '"f(t)"')
    sweep(tmp_path, f"{E}=1,2", text=curve)
    (tmp_path / "force.csv").write_text("0,0\n1,3e-9\n")
    fsci("run", tmp_path, "-o", tmp_path / "third")
    out = tmp_path / "out"
    ended = fsci("diff", out / "E=1", out / "E=2", tmp_path / "third", "-o", out / "pictures")
    assert ended.returncode == 0, ended.stderr
    softer, third = ended.stdout.split("E=1 -> third")
    assert f"  {E}: 1 -> 2\n" in softer
    assert ["end.x", "2e-09", "1e-09", "-50", "%", "50", "%"] in words(softer)
    assert "force.csv: other content" in third
    assert ["end.x", "2e-09", "6e-09", "+66.7", "%", "66.7", "%"] in words(third)
    assert (tmp_path / "out" / "pictures" / "diff_end.png").stat().st_size > 10_000


def test_pictures_in_a_plane_have_units_per_depth(tmp_path, monkeypatch):
    """Of the sweep as of the differences: a force in N/mm in cases of mm, t and s."""
    panels = {}
    for module in ("fsci.sweep.picture", "fsci.diff"):
        found = panels.setdefault(module, [])
        monkeypatch.setattr(f"{module}.plot_lines", lambda path, drawn, *rest, found=found, **more: found.extend(drawn))
    force = BAR.replace("probes: {", "probes: {force: {quantity: reaction, on: left}, ")
    (tmp_path / "case.yaml").write_text("units: {length: mm, mass: t}\n" + force)
    assert fsci("run", tmp_path, "-o", tmp_path / "out").returncode == 0
    diff([tmp_path / "out", tmp_path / "out"], tmp_path / "pictures")
    row = {"force.x": 1.0, "end.x": 2.0}
    two = [Combination("E=1", ("1",)), Combination("E=2", ("2",))]
    list(draw(tmp_path, load_case(tmp_path), [Parameter("E", ("1", "2"))], two, list(row), [row, row]))
    expected = {"force.x [N/mm]", "end.x [mm]"}
    assert panels["fsci.sweep.picture"] == ["force.x [N/mm]", "end.x [mm]"]
    assert expected <= set(panels["fsci.diff"])


def test_diff_shows_forces_of_contact(tmp_path):
    """Two runs that differ in nothing else."""
    for name, force in (("one", 2.0), ("two", 3.0)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "case.yaml").write_text(BAR)
        writer = HistoryWriter(tmp_path / name / "history.csv")
        for step in (1, 2):
            columns = {"contact.press.x": force * step, "contact.press.y": 0.0, "contact.active": 4.0}
            writer.write(step, 0.1 * step, 0.1, 3, 0.0, columns)
    lines = diff([tmp_path / "one", tmp_path / "two"], tmp_path / "pictures")
    assert ["contact.press.x", "4", "6", "+33.3", "%", "33.3", "%"] in words("\n".join(lines))
    assert not any("contact.active" in line for line in lines)
    assert (tmp_path / "pictures" / "diff_contact.press.png").stat().st_size > 10_000


def test_diff_of_the_same_case_and_of_no_results(tmp_path):
    (tmp_path / "case.yaml").write_text(BAR)
    for name in ("one", "two"):
        fsci("run", tmp_path, "-o", tmp_path / name)
    ended = fsci("diff", tmp_path / "one", tmp_path / "two", "-o", tmp_path)
    assert "the cases are the same" in ended.stdout
    assert ["end.x", "2e-09", "2e-09", "0", "0"] in words(ended.stdout)
    assert fsci("diff", tmp_path / "one").stderr == "fsci diff: give the folders of two or more runs\n"
    assert "has no results of a run" in fsci("diff", tmp_path / "one", tmp_path / "nothing").stderr
