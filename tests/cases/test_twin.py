"""`fsci twin`: a flow and two blocks, whose twins have known answers; what fails; what is not run twice."""

import json

import pytest
from programs import fsci

pytestmark = pytest.mark.usefixtures("runs_in_copies")

FLOW = """
time: {step: 1, end: 1}
fluid:
  density: 1
  viscosity: 1
  element: q1q1
  flow: stokes
  scheme: steady
  grid: {from: [0, 0], to: [2, 1], cells: [16, 8]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1-y)", 0]}
    walls: {on: [y-, y+], no_slip: true}
    outlet: {on: x+, outflow: true}
  bodies:
    disc: {mesh: {shape: disc, radius: 0.2, cells: [32, 2], translate: [1, 0.5]}}
probes:
  drag: {body: disc, quantity: force}
"""

BLOCKS = """
time: {step: 1, end: 1}
structure:
  bodies:
    low:
      mesh: {shape: rectangle, size: [1, 1], cells: [2, 2], order: 1}
      material: {law: neo_hooke, E: 100, nu: 0}
      supports: [{on: bottom, displacement: [0, 0]}]
    high:
      mesh: {shape: rectangle, size: [1, 1], origin: [0, 1], cells: [3, 3], order: 1}
      material: {law: neo_hooke, E: 100, nu: 0}
      supports: [{on: top, displacement: [0, -0.1]}]
contact:
  pairs: {blocks: {slave: {body: high, on: bottom}, master: {body: low, on: top}}}
probes: {top: {body: high, quantity: displacement, at: [0, 1]}}
verify:
  - {value: contact.blocks.y, reference: 5, relative: 1}
"""


def twin(folder, text, *arguments, code=0):
    (folder / "case.yaml").write_text(text)
    ended = fsci("twin", folder, "-o", folder / "out", *arguments)
    assert ended.returncode == code, ended.stdout + ended.stderr
    return ended, json.loads((folder / "out" / "twin.json").read_text())


def test_a_flow(tmp_path):
    """The element twin is the error: the other element, on twice as many cells in each direction, agrees with it."""
    ended, found = twin(tmp_path, FLOW, "--only", "element", "--only", "processes")
    assert list(found["runs"]) == ["case", "element", "processes"]
    drag = found["values"]["drag.x"]
    assert drag["changes"]["processes"]["curve"] < 1e-9
    fine = tmp_path / "fine"
    fsci("run", tmp_path, "-o", fine, "--set", "fluid.element=q2q1", "--set", "fluid.grid.cells=[32, 16]")
    exact = json.loads((fine / "summary.json").read_text())["probes"]["drag.x"]["final"]
    error = (exact - drag["value"]) / drag["scale"]
    assert 0.005 < abs(error)
    assert drag["changes"]["element"]["value"] == pytest.approx(error, rel=0.3)
    assert "element: element q2q1: drag.x" in ended.stdout
    assert "the error of cells or facets is about as large" in ended.stdout
    assert "processes: two processes: nothing changes" in ended.stdout
    times = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("*/history.csv")}
    twin(tmp_path, FLOW, "--quick")
    twin(tmp_path, FLOW, "--only", "element", "--only", "processes")
    for path, before in times.items():
        assert path.stat().st_mtime_ns == before
    assert {path.parent.name for path in (tmp_path / "out").glob("*/history.csv")} == {
        "case", "element", "processes", "coarse", "facets",
    }  # fmt: skip
    (tmp_path / "case.yaml").write_text(FLOW.replace("radius: 0.2", "radius: 0.25"))
    _, other = twin(tmp_path, FLOW.replace("radius: 0.2", "radius: 0.25"), "--only", "facets")
    assert other["values"]["drag.x"]["value"] > 1.05 * drag["value"]


@pytest.mark.slow
def test_what_is_zero_by_symmetry(tmp_path):
    """A difference of pressures above and below, beside a drag: rounding is no change, and no defect of the program."""
    text = FLOW + "  across: {quantity: pressure, at: [0.5, 0.25], minus: [0.5, 0.75]}\n"
    ended, found = twin(
        tmp_path, text, "--only", "shift", "--only", "mirrored", "--only", "turned", "--only", "element"
    )
    changes = found["values"]["across"]["changes"]
    assert max(changes[name]["curve"] for name in ("mirrored", "turned", "element")) < 1e-9
    assert 1e-5 < max(changes[f"shift_{n}"]["curve"] for n in range(1, 9)) < 0.05
    assert "the answer must not depend on it" not in ended.stdout


def test_blocks(tmp_path):
    """Uniform strain: neither roles, orders nor c_n change anything, and the force on the slave turns round."""
    ended, found = twin(tmp_path, BLOCKS)
    assert set(found["runs"]) == {
        "case", "step", "order", "exchange", "reversed", "c_n", "mirrored", "turned", "processes",
    }  # fmt: skip
    for name in ("top.y", "contact.blocks.y final"):
        for change in found["values"][name]["changes"].values():
            assert change["curve"] < 1e-7
    assert ended.stdout.count("nothing changes") == 8


def test_a_twin_that_fails_is_a_finding(tmp_path):
    """With cells twice as large, the finest ones around the disc are too few; the message is that of the run."""
    text = FLOW.replace("cells: [16, 8]", "cells: [16, 8], refine: [{box: [[0.5, 0.01], [1.5, 0.99]]}]")
    ended, found = twin(tmp_path, text, "--only", "coarse", code=1)
    assert "not of the finest level" in found["runs"]["coarse"]["message"]
    assert found["runs"]["coarse"]["message"] in ended.stdout
    last = ended.stdout.splitlines()[-1]
    assert last.startswith("coarse: element q2q1, cells twice as large: failed: ")
    assert last.endswith(": refine around it with 3 layers or more, or in a box over all of its way")
    assert found["runs"]["case"]["message"] == ""


def test_a_case_that_fails(tmp_path):
    text = BLOCKS.replace("displacement: [0, -0.1]", "displacement: [0, -3]")
    _, found = twin(tmp_path, text, "--set", "time.retry.halvings=0", code=1)
    assert found["runs"]["case"]["message"]
    assert found["values"] == {}


def test_names(tmp_path):
    (tmp_path / "case.yaml").write_text(BLOCKS)
    ended = fsci("twin", tmp_path, "-o", tmp_path / "out", "--only", "exchang")
    assert ended.returncode == 2
    assert (
        "this case has step, order, exchange, reversed, c_n, mirrored, turned, processes, but no twin 'exchang'; "
        "did you mean 'exchange'?" in ended.stderr
    )
