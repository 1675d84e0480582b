"""Bodies that the flow moves on nested cells: as on equal cells, on any number of processes, resumed bit for bit."""

import numpy as np
import pytest
from advised import require_explained
from coupled_case import POST
from programs import fsci
from small_scenes import CHANNEL

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.api import FailureKind

NESTED = POST.replace("cells: [20, 10]}", "cells: [10, 5], refine: [{around: post, layers: 4, level: 1}]}")
SOLVING = {"wall", "residual", "iterations", "coupling.newton", "coupling.linear"}
SOLVING |= {"interface.force", "interface.momentum", "fluid.mass"}

#: a free ball in 3D, with the iterative solver
BALL = """\
title: a ball sinks
time: {step: 0.02, end: 0.06}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  gravity: [0, 0, -9.81]
  grid: {from: [0, 0, 0], to: [1.5, 1, 1], cells: [6, 4, 4], refine: [{around: ball, layers: 4, level: 1}]}
  patches:
    top: {on: z+, outflow: true}
    walls: {on: [x-, x+, y-, y+, z-], no_slip: true}
  bodies:
    ball:
      mesh: {shape: sphere, radius: 0.15, cells: [4, 2], translate: [0.41, 0.52, 0.57]}
      free: {density: 3}
coupling: {scheme: monolithic}
probes:
  force: {quantity: force}
  speed: {quantity: velocity, at: [1.4, 0.5, 0.5]}
solver: {newton: {residual: 1.0e-11}, linear: {method: iterative, tolerance: 1.0e-12}}
"""

LEAVING = "title: a disc leaves\ntime: {step: 0.02, end: 0.4}\n"
LEAVING += (
    CHANNEL.replace("10]}", "10], refine: [{box: [[0.3, 0], [1.3, 1]], level: 1}]}")
    + """\
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.78, 0.51]}
      motion: {velocity: [1.5, 0]}
"""
)

#: a free disc that sinks by three large cells and turns
SINKING = """\
title: a disc sinks
time: {step: 0.02, end: 0.46}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  grid: {from: [0, 0], to: [1, 1.5], cells: [10, 15], refine: [{around: disc, layers: 5, level: 1}]}
  patches:
    top: {on: y+, outflow: true}
    walls: {on: [x-, x+, y-], no_slip: true}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.14, cells: [24, 2], translate: [0.46, 1.02]}
      free: {density: 3, gravity: [0, -9.81]}
coupling: {scheme: monolithic}
probes:
  force: {quantity: force}
  disc: {body: disc, quantity: centre}
  turning: {body: disc, quantity: angular_momentum}
  speed: {quantity: velocity, at: [0.9, 0.5]}
solver: {newton: {residual: 1.0e-11}}
"""


def run(text, folder, *overrides):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml", [("verify", "[]"), *overrides]), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


def differ(one, other, name):
    """Relative to the largest component of what it belongs to."""
    size = max(np.abs(one[n]).max() for n in one if n.partition(".")[0] == name.partition(".")[0])
    return np.abs(one[name] - other[name]).max() / (size + 1e-12)


@pytest.fixture(scope="module")
def nested(tmp_path_factory):
    folder = tmp_path_factory.mktemp("nested")
    return folder, run(NESTED, folder)


def test_halved_everywhere_is_an_equal_grid(tmp_path):
    everywhere = POST.replace("[20, 10]}", "[10, 5], refine: [{box: [[0, 0], [2, 1]]}]}")
    one, other = run(POST, tmp_path / "equal"), run(everywhere, tmp_path / "halved")
    for name in ("tip.x", "tip.y", "force.x", "force.y", "outflow"):
        assert differ(one, other, name) < 1e-9, name


def test_schemes_agree(nested, tmp_path):
    other = run(NESTED.replace("scheme: monolithic", "scheme: partitioned, tolerance: 1.0e-8"), tmp_path)
    for name in ("tip.x", "tip.y", "force.x", "force.y", "outflow"):
        assert differ(nested[1], other, name) < 1e-7, name


@pytest.fixture(scope="module")
def sinking(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sinking")
    return folder, run(SINKING, folder)


def test_cells_follow_a_free_body(sinking, tmp_path):
    """By more than its layers; as with fine cells on all of its way, to what the larger cells around change."""
    _, found = sinking
    assert found["disc.y"][0] - found["disc.y"][-1] > 0.3
    box = run(SINKING.replace("{around: disc, layers: 5, level: 1}", "{box: [[0, 0], [1, 1.5]], level: 1}"), tmp_path)
    assert differ(found, box, "disc.y") < 1e-3
    assert differ(found, box, "force.y") < 0.02
    assert np.abs(found["fluid.mass"]).max() < 1e-9


@pytest.mark.parametrize(
    ("processes", "end"),
    [
        pytest.param(2, 0.28, marks=pytest.mark.slow),
        pytest.param(2, 0.46, marks=pytest.mark.slow),
        pytest.param(3, 0.28, marks=pytest.mark.slow),
    ],
)
def test_cells_follow_on_several_processes(sinking, tmp_path, processes, end):
    """While it sinks by more than one large cell."""
    folder, whole = sinking
    done = fsci("run", folder, "-o", tmp_path / "out", "--set", f"time.end={end}", processes=processes)
    assert done.returncode == 0, done.stdout + done.stderr
    several = read_history(tmp_path / "out" / "history.csv")
    assert several["disc.y"][0] - several["disc.y"][-1] > 0.1
    one = {name: column[: len(several["step"])] for name, column in whole.items()}
    for name in one.keys() - SOLVING:
        assert differ(one, several, name) < 1e-8, name


@pytest.mark.slow
@pytest.mark.parametrize("text", [pytest.param(NESTED, id="post"), pytest.param(BALL, id="ball")])
def test_two_processes(text, tmp_path, nested):
    one = nested[1] if text is NESTED else run(text, tmp_path)
    (tmp_path / "case.yaml").write_text(text)
    done = fsci("run", tmp_path, "-o", tmp_path / "two", "--set", "verify=[]", processes=2)
    assert done.returncode == 0, done.stdout + done.stderr
    two = read_history(tmp_path / "two" / "history.csv")
    for name in one.keys() - SOLVING:
        assert differ(one, two, name) < 1e-8, name


@pytest.mark.parametrize(
    ("text", "whole", "middle", "end"),
    [pytest.param(NESTED, "nested", "0.06", "0.1", marks=pytest.mark.slow), (SINKING, "sinking", "0.28", "0.46")],
)
def test_resumed_bit_for_bit(text, whole, middle, end, tmp_path, request):
    _, uninterrupted = request.getfixturevalue(whole)
    run(text, tmp_path, ("time.end", middle))
    text = (tmp_path / "out" / "case.yaml").read_text()
    (tmp_path / "out" / "case.yaml").write_text(text.replace(f"end: {middle}", f"end: {end}"))
    done = fsci("resume", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    resumed = read_history(tmp_path / "out" / "history.csv")
    for name in uninterrupted.keys() - {"wall"}:
        assert np.array_equal(uninterrupted[name], resumed[name]), name


def test_a_body_that_leaves_the_finest_cells_stops_the_run(tmp_path):
    (tmp_path / "case.yaml").write_text(LEAVING)
    done = fsci("run", tmp_path, "-o", tmp_path / "out", "--set", "time.retry.halvings=0")
    assert done.returncode == 1
    message = "a body comes within 3 cells of cells that are not of the finest level: refine where it is and where it"
    assert message in done.stdout + done.stderr
    require_explained(tmp_path / "out", FailureKind.COARSE_CELLS)
