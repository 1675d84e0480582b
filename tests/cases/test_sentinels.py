"""Sentinels in runs of the program: warnings, columns, resumed runs, several processes, values that are no numbers."""

import json

import numpy as np
import pytest
from programs import fsci, warnings_of

from fsci.case import load_case
from fsci.running.finite import not_numbers
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.fluid.surfaces.sweep import Sweep

RING = """\
title: a spinning ring full of water
time: {step: 0.02, end: 0.12}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  scheme: SCHEME
  grid: {from: [-0.5, -0.5], to: [0.5, 0.5], cells: [20, 20]}
  patches:
    walls: {on: [x-, x+, y-], slip: true}
    open: {on: y+, traction: [0, 0]}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    ring:
      mesh: {shape: ring, inner_radius: 0.2, outer_radius: 0.32, cells: [24, 2], order: 2}
      material: {law: neo_hooke, E: 5000, nu: 0.3, density: 10}
      initial_velocity: ["-3*y", "3*x"]
coupling: {scheme: monolithic}
probes: {p: {quantity: pressure, at: [0, 0]}}
output: {fields_every: 0, checkpoint_every: 1}
"""


def run(folder, text, *arguments, out="out", processes=1):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    done = fsci("run", folder / "case.yaml", "-o", folder / out, *arguments, processes=processes)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_pocket_that_loses_its_water_is_reported(tmp_path, monkeypatch, capsys):
    """A rotating ring whose facets have the flux of their velocity, not of the volume that they sweep."""
    for name in ("velocity", "by_motion"):
        monkeypatch.setattr(Sweep, name, lambda *_: None)
    (tmp_path / "case.yaml").write_text(RING.replace("SCHEME", "backward_euler"))
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") == FINISHED
    found = {(w["kind"], w["body"]): w for w in warnings_of(tmp_path / "out")}
    pocket = found["pocket", "pocket_1"]
    assert pocket["value"] < -0.01
    assert capsys.readouterr().out.count("closed pocket 1 of the fluid") == 1
    volume = read_history(tmp_path / "out" / "history.csv")["fluid.pocket_1"]
    area = 12 * 0.2**2 * np.sin(np.pi / 12)  # of a polygon with 24 corners, whose sides are curved
    assert area < volume[0] < np.pi * 0.2**2
    assert volume[-1] / volume[0] - 1 == pytest.approx(pocket["value"], abs=0.01)


def test_a_pocket_that_keeps_its_water_is_not(tmp_path):
    """With long steps, too: its volume is constant to rounding errors."""
    run(tmp_path, RING.replace("SCHEME", "backward_euler"))
    assert [w for w in warnings_of(tmp_path / "out") if w["kind"] == "pocket"] == []
    volume = read_history(tmp_path / "out" / "history.csv")["fluid.pocket_1"]
    assert volume == pytest.approx(np.full(len(volume), volume[0]), rel=1e-10)


@pytest.mark.slow
def test_resumed_and_parallel_runs_find_the_same(tmp_path):
    """A thin and soft ring that becomes oval: fluid gets lost in its wall."""
    text = RING.replace("SCHEME", "backward_euler").replace("0.32", "0.25").replace("E: 5000", "E: 100")
    text = text.replace('["-3*y", "3*x"]', '["-10*x", "10*y"]')
    run(tmp_path, text)
    run(tmp_path, text, "--set", "time.end=0.04", out="resumed")
    done = fsci("resume", tmp_path / "resumed", "--set", "time.end=0.12")
    assert done.returncode == 0, done.stdout + done.stderr
    run(tmp_path, text, out="parallel", processes=2)
    whole, resumed, parallel = (tmp_path / out for out in ("out", "resumed", "parallel"))
    assert warnings_of(whole) == warnings_of(resumed) != []
    one, other, two = (read_history(out / "history.csv") for out in (whole, resumed, parallel))
    assert all(np.array_equal(one[name], other[name]) for name in one if name != "wall")
    assert one["fluid.pocket_1"] == pytest.approx(two["fluid.pocket_1"], rel=1e-9)
    messages = [[(w["kind"], w["body"], w["time"]) for w in warnings_of(out)] for out in (whole, parallel)]
    assert messages[0] == messages[1]


CHANNEL = """\
title: a channel
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 0.02
  element: q1q1
  grid: {from: [0, 0], to: [2, 1], cells: [10, 5]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
  bodies:
    gate:
      mesh: {shape: rectangle, size: [0.4, 1.3], cells: [2, 4], origin: [0.93, 0.3]}
      motion: {displacement: [0, "-2.25*t"]}
probes:
  q: {quantity: flow_rate, through: outlet}
  inside: {quantity: pressure, at: [0.5, 0.5]}
  fast: {quantity: speed, box: [[0.4, 0.4], [0.6, 0.6]]}
output: {fields_every: 0}
"""


def test_inflow_that_cannot_leave_is_reported(tmp_path):
    """A gate closes the channel in the second step."""
    run(tmp_path, CHANNEL)
    (found,) = warnings_of(tmp_path / "out")
    assert (found["kind"], found["body"], found["time"]) == ("mass", "fluid", 0.2)
    assert "has no open patch" in found["message"]
    run(tmp_path / "open", CHANNEL.replace("-2.25*t", "-1*t"))
    assert warnings_of(tmp_path / "open" / "out") == []


def test_values_that_are_no_numbers_are_named(tmp_path, monkeypatch):
    (tmp_path / "case.yaml").write_text(CHANNEL)
    case = load_case(tmp_path, [])
    nan, inf = float("nan"), float("inf")
    numbers = {
        "q": nan,
        "inside": nan,
        "fast": nan,
        "fast.place.x": nan,
        "fluid.mass": nan,
        "fluid.pocket_1": nan,
        "residual": 1.0,
        "wall": inf,
    }
    found = not_numbers(case, numbers)
    assert [finding.body for finding in found] == ["q", "fluid.mass", "wall"]  # 'inside' may be covered by a body
    assert found[0].message == "the column 'q' of history.csv is not a number: look at what it is computed from"
    assert "'wall' of history.csv is infinite" in found[2].message
    assert not_numbers(case, {"inside": inf})[0].body == "inside"
    assert json.loads(json.dumps([finding.kind for finding in found])) == ["nan"] * 3
