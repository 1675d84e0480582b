"""`fsci converge`: a flow and a body whose errors are known; what is not run again; what it refuses."""

import json
import os
import signal
import subprocess
import time

import meshio  # noqa: TID253
import numpy as np
import pytest
from programs import ENVIRONMENT, command, fsci

from fsci import shapes

pytestmark = pytest.mark.usefixtures("runs_in_copies")

FLOW = """
# a disc in a channel
time: {step: 1, end: 1}
fluid:
  density: 1
  viscosity: 1
  element: q1q1
  flow: stokes
  scheme: steady
  grid: {from: [0, 0], to: [2, 1], cells: [32, 16]}   # a coarse one
  patches:
    inlet: {on: x-, velocity: ["4*y*(1-y)", 0]}
    walls: {on: [y-, y+], no_slip: true}
    outlet: {on: x+, outflow: true}
  bodies:
    disc: {mesh: {shape: disc, radius: 0.2, cells: [32, 2], translate: [1, 0.5]}}
probes:
  drag: {body: disc, quantity: force}
  dp: {quantity: pressure, at: [0.3, 0.5], minus: [1.7, 0.5]}
  across: {quantity: pressure, at: [0.5, 0.25], minus: [0.5, 0.75]}
"""

#: A ring under pressure from inside (Lame): u = 1.3e-3 (0.4 r + 4 / r) / 3.
RING = """
time: {step: 1, end: 1}
structure:
  bodies:
    ring:
      mesh: {shape: ring, inner_radius: 1, outer_radius: 2, angle: 90, cells: [12, 8], order: 1}   # first order
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.3}
      kinematics: linear
      supports: [{on: [start, end], symmetry: true}]
      tractions: [{on: inner, value: ["x/sqrt(x^2 + y^2)", "y/sqrt(x^2 + y^2)"]}]
probes:
  inner: {quantity: displacement, at: [1, 0]}
"""
INNER = 1.3e-3 * 4.4 / 3.0
COOK_END = 23.96


#: Cook's membrane, plane stress at small strains: the middle of its end goes up by 23.96.
COOK = """
time: {step: 1, end: 1}
structure:
  plane: stress
  bodies:
    membrane:
      mesh: {file: cook.msh}
      material: {law: st_venant_kirchhoff, E: 1, nu: 1/3}
      kinematics: linear
      supports: [{on: left, displacement: [0, 0]}]
      tractions: [{on: right, value: [0, 1/16]}]
probes:
  end: {quantity: displacement, at: [48, 52]}
"""


def write_cook(path, count):
    """gmsh's format 2.2 by hand, with names of both ends."""
    share = np.linspace(0.0, 1.0, count + 1)
    x, y = np.meshgrid(48.0 * share, share, indexing="ij")
    y = (1.0 - share[:, None]) * 44.0 * y + share[:, None] * (44.0 + 16.0 * y)
    number = np.arange(1, x.size + 1).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    rows = [(1, 1, line) for line in zip(number[0, :-1], number[0, 1:], strict=True)]
    rows += [(1, 2, line) for line in zip(number[-1, :-1], number[-1, 1:], strict=True)]
    rows += [(3, 3, quad) for quad in quads]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "3", '1 1 "left"', '1 2 "right"']
    lines += ['2 3 "membrane"', "$EndPhysicalNames", "$Nodes", str(x.size)]
    lines += [f"{n} {a!r} {b!r} 0" for n, a, b in zip(number.flat, x.flat, y.flat, strict=True)]
    lines += ["$EndNodes", "$Elements", str(len(rows))]
    lines += [f"{n} {kind} 2 {tag} {tag} {' '.join(map(str, nodes))}" for n, (kind, tag, nodes) in enumerate(rows, 1)]
    path.write_text("\n".join([*lines, "$EndElements", ""]))


def converge(folder, text, *arguments, code=0):
    (folder / "case.yaml").write_text(text)
    ended = fsci("converge", folder, "-o", folder / "out", *arguments)
    assert ended.returncode == code, ended.stdout + ended.stderr
    return ended, json.loads((folder / "out" / "converge.json").read_text())


def test_a_flow(tmp_path):
    """The band holds the value of q2q1 in cells half as large; runs are not repeated; comments stay."""
    ended, found = converge(tmp_path, FLOW)
    assert "9 runs in" in ended.stdout.splitlines()[0]
    assert "(accurate to a factor of about three)" in ended.stdout.splitlines()[0]
    assert set(found["runs"]) == {
        "case", "coarser_1.41", "coarser_2", "cells_2", "facets_2", "element", "shift_1", "shift_2", "shift_3",
    }  # fmt: skip
    drag = found["values"]["drag.x"]
    fsci("run", tmp_path, "-o", tmp_path / "fine", "--set", "fluid.element=q2q1", "--set", "fluid.grid.cells=[64, 32]",
         "--set", "fluid.bodies.disc.mesh.cells=[256, 2]")  # fmt: skip
    exact = json.loads((tmp_path / "fine" / "summary.json").read_text())["probes"]["drag.x"]["final"]
    assert 0.01 * exact < abs(drag["value"] - exact) < drag["band"] < 0.25 * exact
    assert drag["verdict"] == "resolved"
    assert drag["shares"].keys() == {"cells", "facets"}
    assert sum(drag["shares"].values()) == pytest.approx(1.0)
    assert drag["scatter"] > 0.0
    assert found["runs"]["coarser_2"]["ratios"] == pytest.approx({"cells": 2.0, "facets": 2.0})
    assert found["runs"]["coarser_2"]["values"]["drag.x"] != drag["value"]
    assert "element q2q1, cells twice as large" in ended.stdout
    assert "data:image/png" in (tmp_path / "out" / "report.html").read_text()
    # zero by symmetry, but for grids that are moved: its band is beside the drag, not beside its rounding
    across = found["values"]["across"]
    assert abs(across["value"]) < 1e-9 < across["band"] < 0.05 * across["scale"]
    assert across["verdict"] == "resolved"
    assert "across 0.0" in ended.stdout

    times = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("*/history.csv")}
    again, only = converge(tmp_path, FLOW, "--probe", "drag.x", "--tolerance", "10%")
    assert list(only["values"]) == ["drag.x"]
    assert {path: path.stat().st_mtime_ns for path in times} == times
    cheap = tmp_path / "out" / "cheapest" / "case.yaml"
    assert f"10 %: {cheap}" in again.stdout
    assert "# a coarse one" in cheap.read_text()
    assert only["cheapest"]["tolerance"] == 0.1
    assert fsci("check", cheap).returncode == 0


def test_a_tolerance_goes_upwards(tmp_path):
    """Finer levels, until the band is within the tolerance; the value is that of the finest, and the band holds."""
    ended, found = converge(tmp_path, RING, "--tolerance", "0.1%")
    assert "finer_1.41" in found["runs"]
    inner = found["values"]["inner.x"]
    assert abs(inner["value"] - INNER) < inner["band"] < 0.001 * INNER
    assert inner["order"] == pytest.approx(2.0, abs=0.2)
    assert inner["verdict"] == "resolved"
    assert set(inner["twins"]) == {"order"}
    assert "elastic bodies of second order" in ended.stdout
    assert "0.1 %: " in ended.stdout
    cheap = tmp_path / "out" / "cheapest"
    fsci("run", cheap, "-o", tmp_path / "cheap")
    value = json.loads((tmp_path / "cheap" / "summary.json").read_text())["probes"]["inner.x"]["final"]
    assert value == pytest.approx(INNER, rel=0.001)


def test_a_mesh_file(tmp_path):
    """Cells of a file are halved, twice: the band of the finest level holds the exact value, and not by much."""
    write_cook(tmp_path / "cook.msh", 8)
    ended, found = converge(tmp_path, COOK, "--probe", "end.y")
    assert set(found["runs"]) == {"case", "finer_2", "finer_4"}
    end = found["values"]["end.y"]
    coarse, middle, fine = (found["runs"][name]["values"]["end.y"] for name in ("case", "finer_2", "finer_4"))
    assert coarse < middle < fine == end["value"] < COOK_END
    assert abs(end["value"] - COOK_END) < end["band"] < 0.02 * COOK_END
    assert end["verdict"] == "resolved"
    assert "end.y 23." in ended.stdout
    # the case itself with halved cells: the levels are coarser ones
    text = COOK.replace("cook.msh", "cook.msh, refine: 2")
    _, again = converge(tmp_path, text, "--probe", "end.y")
    assert set(again["runs"]) == {"case", "coarser_2", "coarser_4"}
    assert again["values"]["end.y"]["value"] == end["value"]
    assert again["values"]["end.y"]["band"] == pytest.approx(end["band"], rel=1e-12)


def test_a_mesh_file_of_a_curved_body(tmp_path):
    """A ring of 8 facets on a quarter: its polygon is not the ring, and no level shows how much that is."""
    mesh = shapes.ring(inner_radius=1.0, outer_radius=2.0, angle=90.0, cells=(8, 6))
    lines = [(f"{name}", facets) for name, facets in mesh.surfaces.items()]
    cells = [("quad", mesh.cells), *(("line", facets) for _, facets in lines)]
    sets = {name: [[]] * (1 + n) + [range(len(facets))] + [[]] * (3 - n) for n, (name, facets) in enumerate(lines)}
    points = np.pad(mesh.points, ((0, 0), (0, 1)))
    meshio.write(tmp_path / "ring.inp", meshio.Mesh(points, cells, cell_sets=sets))
    shape = RING[RING.index("{shape: ring") : RING.index("   # first order")]
    ended, found = converge(tmp_path, RING.replace(shape, "{file: ring.inp}"), "--probe", "inner.x")
    assert found["values"]["inner.x"]["verdict"] == "indicative"
    words = "the facets of curved surfaces in mesh files are the same on all levels: ring (ring.inp)"
    assert words in ended.stdout
    assert found["runs"].keys() == {"case", "finer_2", "finer_4"}


def test_out_of_the_budget(tmp_path):
    """The case itself runs, and what is left out is said."""
    ended, found = converge(tmp_path, RING, "--budget", "0.01s", "--tolerance", "0.1%")
    assert list(found["runs"]) == ["case"]
    assert "order        left out: " in ended.stdout
    assert "needed, 0 s left of the budget" in ended.stdout
    assert "inner.x 0.00" in ended.stdout
    assert "no band: NOT RESOLVED: no other level has this value" in ended.stdout


def test_runs_of_another_case_count_in_the_budget(tmp_path):
    """Those that are in the folder are free, and as soon as the case has changed they are not."""
    ended, found = converge(tmp_path, RING)
    assert len(found["runs"]) == 4
    ended, again = converge(tmp_path, RING, "--budget", "0.01s")
    assert "4 runs in" in ended.stdout
    assert "(4 of them are there): about 0 s" in ended.stdout
    assert again["runs"].keys() == found["runs"].keys()
    ended, other = converge(tmp_path, RING.replace("E: 1000", "E: 2000"), "--budget", "0.01s")
    assert list(other["runs"]) == ["case"]
    assert ended.stdout.count("left out: ") == 3
    assert other["values"]["inner.x"]["value"] == pytest.approx(0.5 * found["values"]["inner.x"]["value"])


def test_a_level_that_refuses(tmp_path):
    """Cells twice as large come too close to coarse ones; its message is that of the check."""
    text = FLOW.replace("cells: [32, 16]", "cells: [32, 16], refine: [{box: [[0.66, 0.16], [1.34, 0.84]]}]")
    ended, found = converge(tmp_path, text, "--probe", "drag")
    refused = [name for name, run in found["runs"].items() if "not of the finest level" in run["message"]]
    assert refused
    assert "has no result: body 'disc' comes within 3 cells" in ended.stdout
    assert found["values"]["drag.x"]["verdict"] == "indicative"


def test_a_case_that_fails(tmp_path):
    text = RING.replace("linear", "finite").replace('"x/sqrt', '"-1e5*x/sqrt')
    _, found = converge(tmp_path, text, "--set", "time.retry.halvings=0", code=1)
    assert found["runs"]["case"]["message"]
    assert found["values"] == {}


def test_words_of_mistakes(tmp_path):
    (tmp_path / "case.yaml").write_text(FLOW)

    def refused(*arguments):
        ended = fsci("converge", tmp_path, "-o", tmp_path / "out", *arguments)
        assert ended.returncode == 2
        assert not (tmp_path / "out").exists()
        return ended.stderr

    assert "--probe: there is no probe 'drga'; did you mean 'drag'?" in refused("--probe", "drga")
    said = refused("--probe", "iterations")
    assert "--probe: 'iterations' says what the program did: it has no exact value, and no band" in said
    assert "write a share between 0 and 1 such as 0.02 or 2%, not '2'" in refused("--tolerance", "2")
    assert "write a time such as 30s, 20min or 2h, not 'soon'" in refused("--budget", "soon")
    (tmp_path / "case.yaml").write_text(FLOW.split("probes:")[0])
    assert "the case has neither 'probes' nor 'verify': there is no value whose error could be estimated" in refused()


def test_interrupted(tmp_path):
    """Ctrl-C, which all processes get, keeps the runs that have ended; the same command goes on."""
    (tmp_path / "case.yaml").write_text(FLOW)
    out = tmp_path / "out"
    program = subprocess.Popen(
        command("converge", tmp_path, "-o", out), env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # shells let background jobs ignore it
    )  # fmt: skip
    until = time.monotonic() + 120.0
    while not (out / "converge.json").exists() and time.monotonic() < until:
        time.sleep(0.05)
    os.killpg(program.pid, signal.SIGINT)
    _, said = program.communicate(timeout=120)
    assert program.returncode == 3
    assert said == "stopped; the same command goes on from here\n"
    kept = json.loads((out / "converge.json").read_text())["runs"]
    assert 1 <= len(kept) < 9
    _, found = converge(tmp_path, FLOW)
    assert len(found["runs"]) == 9
