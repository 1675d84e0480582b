"""What may change when a run is resumed: by --set and in the case file of the results alike, and what is said of it."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from fsci.case.load import load_case
from fsci.case.resume import changed
from fsci.case.settings import in_words, settings_of
from fsci.cli import execute
from fsci.running.history import read_history

BEAM = """\
time: {step: 0.002, end: 0.1}
curves: {f: {csv: f.csv}}
structure:
  dynamics: {rho_inf: 1}
  bodies:
    beam:
      mesh: {shape: rectangle, size: [1, 0.2], cells: [8, 2], order: 1}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, 0]}]
      gravity: [0, "10*f(t)"]
probes:
  tip: {quantity: displacement, at: [1, 0.2]}
"""
FLOW = """\
time: {step: 0.1, end: 0.3}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  grid: {from: [0, 0], to: [2, 1], cells: [12, 6]}
  patches:
    inlet: {on: x-, velocity: ["y*(1-y)", 0]}
    walls: {on: [y-, y+], no_slip: true}
    outlet: {on: x+, outflow: true}
  bodies:
    moving: {mesh: {shape: disc, radius: 0.2, cells: [8, 1], translate: [0.5, 0.5]}, motion: {velocity: [0.1, 0]}}
    still: {mesh: {shape: disc, radius: 0.2, cells: [8, 1], translate: [1.5, 0.5]}}
probes: {drag: {quantity: force, body: moving}}
"""
CONTACT = """\
time: {step: 0.1, end: 0.3}
structure:
  bodies:
    a:
      mesh: {shape: rectangle, size: [1, 1], cells: [4, 4]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: top, displacement: ["0.1*t", -0.02]}]
contact:
  obstacles: {w: {mesh: {shape: rectangle, size: [3, 1], cells: [3, 1], origin: [-1, -1.01]}, on: top}}
  pairs: {p: {slave: {body: a, on: bottom}, master: {obstacle: w}, friction: {coefficient: 0.1}}}
probes: {v: {quantity: displacement, at: [1, 0.5]}}
"""
CASES = {"beam": BEAM, "flow": FLOW, "contact": CONTACT}


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("computed")
    for name, text in CASES.items():
        (folder / name).mkdir()
        (folder / name / "case.yaml").write_text(text)
        (folder / name / "f.csv").write_text("0, -1\n1, -1\n")
        assert execute(["run", str(folder / name), "-o", str(folder / name / "out")]) == 0
    return folder


@pytest.fixture
def results(computed, tmp_path):
    """A copy of the results of a case."""

    def function(name):
        return shutil.copytree(computed / name / "out", tmp_path / name)

    return function


def resume(out, *changes):
    return execute(["resume", str(out), *(word for change in changes for word in ("--set", change))])


CHANGES = [
    ("beam", "structure.bodies.beam.material.E=1500", "structure.bodies.beam.material.E: 1000 -> 1500"),
    ("beam", "structure.bodies.beam.gravity=[1, 0]", "structure.bodies.beam.gravity: [0, 10*f(t)] -> [1, 0]"),
    ("beam", "structure.bodies.beam.supports.0.displacement=[0, t]", "supports.0.displacement: [0, 0] -> [0, t]"),
    ("beam", "structure.bodies.beam.supports=[]", "supports: [{on: [left], displacement: [0, 0], "),
    (
        "beam",
        "structure.bodies.beam.springs=[{on: top, stiffness: 9}]",
        "springs: not set -> [{on: [top], stiffness: 9",
    ),
    ("beam", "structure.dynamics.damping.mass=3", "structure.dynamics.damping.mass: 0 -> 3"),
    ("beam", "curves.f={table: [[0, 1], [1, 2]]}", "curves.f.csv: 2 points, checksum "),
    ("beam", "probes={}", "probes.tip: {field: structure, body: beam, quantity: displacement, at... -> not set"),
    ("beam", "output.fields_every=0", "output.fields_every: 1 -> 0"),
    ("flow", "fluid.viscosity=0.2", "fluid.viscosity: 0.1 -> 0.2"),
    ("flow", "fluid.patches.inlet.velocity.0=y", "fluid.patches.inlet.velocity: [y*(1-y), 0] -> [y, 0]"),
    ("flow", "fluid.patches.outlet={on: x+, pressure: t}", "fluid.patches.outlet.pressure: not set -> t"),
    ("flow", "fluid.bodies.moving.motion={displacement: [0.1*t, 0]}", "motion.displacement: not set -> [0.1*t, 0]"),
    ("flow", "fluid.bodies.moving.motion.velocity.0=where(t > 0.3, 1, 0.1)", "velocity: [0.1, 0] -> [where(t > 0.3, "),
    ("flow", "fluid.bodies.still.motion={displacement: [0, t - 0.3]}", "still.motion: not set -> {displacement: [0, t"),
    ("contact", "contact.pairs.p.friction={bound: 1}", "contact.pairs.p.friction.bound: not set -> 1"),
    ("contact", "contact.friction={coefficient: 0.2}", "contact.friction: not set -> {coefficient: 0.2}"),
    ("contact", "contact.obstacles.w.motion=[0, t - 0.3]", "contact.obstacles.w.motion: not set -> [0, t - 0.3]"),
]


@pytest.mark.parametrize(("name", "change", "line"), CHANGES, ids=[change for _, change, _ in CHANGES])
def test_loads_motions_materials_probes_and_outputs_may_change(results, name, change, line, capfd):
    out = results(name)
    steps = len(read_history(out / "history.csv")["time"])
    end = load_case(out).time.end * 1.1
    assert resume(out, change, f"time.end={end}") == 0
    said = [words for words in capfd.readouterr().out.splitlines() if words.startswith("changed: ")]
    assert any(line in words for words in said), said
    assert f"changed: time.end: {end / 1.1:.12g} -> {end:.12g}" in said
    assert set(said) <= set((out / "log.txt").read_text().splitlines())
    assert len(read_history(out / "history.csv")["time"]) > steps
    setting, _, value = change.partition("=")
    given = load_case(out, [(setting, value)])
    assert settings_of(given) == settings_of(load_case(out)), "the case of the results has the change"


def test_edits_of_the_case_file_are_as_good(results, capfd):
    by_option, by_hand = results("flow"), results("beam").parent / "by_hand"
    shutil.copytree(by_option, by_hand)
    assert resume(by_option, "fluid.viscosity=0.2", "time.end=0.5") == 0
    said = capfd.readouterr().out
    text = (by_hand / "case.yaml").read_text()
    (by_hand / "case.yaml").write_text(text.replace("viscosity: 0.1", "viscosity: 0.2").replace("end: 0.3", "end: 0.5"))
    assert resume(by_hand) == 0
    lines = [line for line in said.splitlines() if line.startswith("changed: ")]
    assert lines == [line for line in capfd.readouterr().out.splitlines() if line.startswith("changed: ")]
    one, two = read_history(by_option / "history.csv"), read_history(by_hand / "history.csv")
    assert np.array_equal(one["drag.x"], two["drag.x"])


FIXED = [
    ("beam", "structure.bodies.beam.mesh.cells=[4, 2]", "structure.bodies.beam.mesh.cells was [8, 2], is [4, 2]"),
    ("beam", "structure.bodies.beam.mesh.size=[1, 0.3]", "structure.bodies.beam.mesh.size was [1, 0.2], is [1, 0.3]"),
    ("beam", "structure.bodies.beam.mesh.translate=[1, 0]", "mesh.translate was not set, is [1, 0]"),
    ("beam", "structure.bodies.beam.element=mixed", "structure.bodies.beam.element was auto, is mixed"),
    ("beam", "structure.bodies.beam.initial_velocity=[1, 0]", "it counts at the start only, which is over"),
    ("beam", "structure.dynamics=", "structure.dynamics was {rho_inf: 1, "),
    ("beam", "time.start=0.01", "time.start was 0, is 0.01: it cannot change when a run is resumed, the run has begun"),
    ("flow", "fluid.element=q2q1", "fluid.element was q1q1, is q2q1"),
    ("flow", "fluid.scheme=backward_euler", "fluid.scheme was bdf2, is backward_euler"),
    ("flow", "fluid.grid.cells=[24, 12]", "fluid.grid.cells was [12, 6], is [24, 12]"),
    ("flow", "fluid.bodies.moving.motion.velocity=[0.2, 0]", "the body would jump by 0.03 at 0.3, the time of the"),
    ("flow", "fluid.bodies.still.motion={displacement: [t, 0]}", "the body would jump by 0.3 at 0.3"),
    ("contact", "contact.pairs.p.integration=elements", "contact.pairs.p.integration was segments, is elements"),
    ("contact", "contact.obstacles.w.mesh.origin.1=-1", "mesh.origin was [-1, -1.01], is [-1, -1]"),
]


@pytest.mark.parametrize(("name", "change", "message"), FIXED, ids=[change for _, change, _ in FIXED])
def test_what_the_state_belongs_to_stays(results, name, change, message, capfd):
    out = results(name)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file() and path.name != "log.txt"}
    if change == "structure.dynamics=":
        text = (out / "case.yaml").read_text().replace("  dynamics: {rho_inf: 1}\n", "")
        (out / "case.yaml").write_text(text)
        del before[out / "case.yaml"]
        assert resume(out, "time.end=1") == 2
    else:
        assert resume(out, change, "time.end=1") == 2
    assert message in capfd.readouterr().err
    assert all(path.read_bytes() == content for path, content in before.items())


def test_all_of_them_are_named_with_their_places(results, capfd):
    out = results("beam")
    text = (out / "case.yaml").read_text()
    (out / "case.yaml").write_text(text.replace("[8, 2]", "[8, 3]").replace("step: 0.002", "step: 1"))
    assert resume(out, "structure.plane=stress") == 2
    error = capfd.readouterr().err
    cells = r"case.yaml:7:\d+: structure.bodies.beam.mesh.cells was \[8, 2\], is \[8, 3\]: it cannot change"
    assert re.search(cells, error)
    assert "--set structure.plane=stress: structure.plane was strain, is stress: it cannot change" in error
    assert "time.step" not in error


def test_another_mesh_of_the_same_file(tmp_path, capfd):
    """As many nodes, but other positions: the file in the results was replaced."""
    import meshio

    def write(folder, height):
        points = np.array([[x, y, 0] for y in (0, height) for x in (0, 1, 2.0)])
        quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
        meshio.write(folder / "m.inp", meshio.Mesh(points, [("quad", quads)], point_sets={"left": np.array([0, 3])}))

    write(tmp_path, 1.0)
    (tmp_path / "case.yaml").write_text(
        BEAM.replace("{shape: rectangle, size: [1, 0.2], cells: [8, 2], order: 1}", "{file: m.inp}")
    )
    (tmp_path / "f.csv").write_text("0, -1\n1, -1\n")
    out = tmp_path / "out"
    assert execute(["run", str(tmp_path), "-o", str(out), "--set", "probes.tip.at=[2, 0]"]) == 0
    write(out, 1.0 + 1e-12)
    assert resume(out, "time.end=0.2") == 0
    write(out, 1.001)
    assert resume(out, "time.end=0.3") == 2
    error = capfd.readouterr().err
    assert "structure.bodies.beam.mesh was 6 nodes, 2 cells, checksum " in error
    assert f"{out / 'case.yaml'}:7:" in error


def test_energy_is_balanced_with_other_materials(results):
    """That the energy of a state is another one with them counts as if it had been so at the start."""
    for change in ("material.E=3000", "material.density=2", "springs=[{on: right, stiffness: 100}]"):
        out = results("beam")
        assert resume(out, f"structure.bodies.beam.{change}", "time.end=0.2") == 0
        assert np.abs(read_history(out / "history.csv")["structure.energy"]).max() < 2e-5
        shutil.rmtree(out)


def test_columns_of_probes_come_and_go(results, tmp_path):
    out = results("beam")
    more = "probes.energy={quantity: energy}"
    assert resume(out, more, "time.end=0.12") == 0
    assert resume(out, "probes={end: {quantity: velocity, at: [1, 0]}}", "time.end=0.14", "verify=[]") == 0
    history = read_history(out / "history.csv")
    names = ["residual", "tip.x", "tip.y", "structure.energy", *(f"energy.{n}" for n in ("kinetic", "internal"))]
    assert list(history)[5:11] == names
    known = {name: np.isfinite(history[name]).tolist() for name in ("tip.x", "energy.total", "end.x")}
    assert known["tip.x"] == [True] * 60 + [False] * 10
    assert known["energy.total"] == [False] * 50 + [True] * 10 + [False] * 10
    assert known["end.x"] == [False] * 60 + [True] * 10
    assert execute(["report", str(out)]) == 0
    check = "verify=[{value: end.x, statistic: max, from: 0.122, reference: 0, absolute: 100}]"
    assert resume(out, check, "time.end=0.15") == 0


@pytest.mark.parametrize("path", sorted(Path("cases").glob("*/case.yaml")), ids=lambda path: path.parent.name)
def test_nothing_differs_between_a_case_and_itself(path):
    """As a checkpoint keeps it."""
    case = load_case(path)
    assert changed(case, json.loads(json.dumps(settings_of(case)))) == []


def test_words():
    assert in_words({"0": {"on": ["left"], "at": None}}) == "[{on: [left]}]"
    assert in_words([1.0, None, "t"]) == "[1, null, t]"
    assert in_words(True) == "true"
    assert in_words({}) == in_words([]) == in_words(None) == "not set"
    assert len(in_words([0.1] * 100)) == 60
