"""Scenes with a fault that no residual shows end with its name in summary.json; their twins without it are silent."""

import json

import pytest
from advised import require_explained
from programs import fsci

from solvers.api import FailureKind

FREE = """\
title: A heavy free disc sinks to the floor
time: {step: 0.02, end: 0.4}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: backward_euler
  grid: {from: [-1, 0], to: [1, 1.5], cells: [16, 12]}
  patches: {walls: {on: [x-, x+, y-], no_slip: true}, top: {on: y+, traction: [0, 0]}}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.25, cells: [24, 1], translate: [0.03, 0.35]}
      free: {density: 5, gravity: [0, -8]}
coupling: {}
contact: none
output: {fields_every: 0}
"""

ELASTIC = """\
title: A soft disc falls to the floor
time: {step: 0.02, end: 0.3}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 1.2], cells: [10, 12]}
  patches: {top: {on: y+, outflow: true}, walls: {on: [x-, x+, y-], slip: true}}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.5, 0.28]}
      material: {law: neo_hooke, E: 3000, nu: 0.3, density: 15}
      gravity: [0, -10]
coupling: {}
output: {fields_every: 0}
"""

FLYING = """\
title: Two discs fly at each other
time: {step: 0.05, end: 0.7}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    a:
      mesh: {shape: disc, radius: 0.5, cells: [24, 2]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      initial_velocity: [1, 0]
    b:
      mesh: {shape: disc, radius: 0.5, cells: [24, 2], translate: [2, 0]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      initial_velocity: [-1, 0]
output: {fields_every: 0}
"""

PAIR = """\
contact: {pairs: {p: {slave: {body: a, on: outer}, master: {body: b, on: outer}}}}
"""

PUSHED = """\
title: A block on springs is pushed away from a wall
time: {step: 0.5, end: 1}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 0.6], cells: [4, 3]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: bottom, displacement: [null, 0]}]
      tractions: [{on: left, value: ["200*t", 0]}]
      springs: [{on: left, stiffness: 0.001}]
contact:
  obstacles:
    wall: {mesh: {shape: rectangle, size: [1, 4], cells: [1, 1], origin: [-1.02, -2]}, on: right}
  pairs:
    wall: {slave: {body: block, on: left}, master: {obstacle: wall}}
output: {fields_every: 0}
"""


def run(text, folder, *, processes=1, arguments=()):
    """(exit code, summary, text of the screen)"""
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    done = fsci("run", folder, "-o", folder / "out", *arguments, processes=processes)
    assert "Traceback" not in done.stdout + done.stderr
    return done.returncode, json.loads((folder / "out" / "summary.json").read_text()), done.stdout


def kinds(summary):
    return [(found["kind"], found["body"]) for found in summary["warnings"]]


@pytest.mark.parametrize(
    ("faulty", "sound", "kind", "body"),
    [
        (FREE, FREE.replace("density: 5", "density: 1.05"), "wall", "disc"),
        (ELASTIC + "contact: none\n", ELASTIC, "wall", "disc"),
        (FLYING, FLYING + PAIR, "overlap", "a and b"),
        (
            FLYING.replace("step: 0.05, end: 0.7", "step: 2, end: 2, retry: {halvings: 0}"),
            FLYING + PAIR,
            "passage",
            "a and b",
        ),
        (PUSHED, PUSHED.replace("0.001", "1000"), "leap", "block"),
    ],
    ids=["free", "elastic", "overlap", "passage", "leap"],
)
def test_seen_and_silent(faulty, sound, kind, body, tmp_path):
    code, summary, screen = run(faulty, tmp_path / "faulty")
    assert code == 1
    assert summary["status"] == "failed"
    assert (kind, body) in kinds(summary)
    found = next(one for one in summary["warnings"] if one["kind"] == kind)
    assert found["message"] in screen
    assert kind in summary["message"]
    assert found["value"] > 0.0
    if kind in ("passage", "leap"):
        require_explained(tmp_path / "faulty" / "out", FailureKind.PASSAGE)
    else:
        require_explained(tmp_path / "faulty" / "out", FailureKind.NOT_HELD)
    resumed = fsci("resume", tmp_path / "faulty" / "out")
    assert resumed.returncode == 1, "the last good state is there, and leads to the same"
    code, summary, _ = run(sound, tmp_path / "sound")
    assert (code, summary["warnings"]) == (0, [])


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Summary: the disc begins to overlap the wall, and is stopped there."""
    return run(FREE, tmp_path_factory.mktemp("alone"))[1]


@pytest.mark.slow
def test_the_same_on_two_processes(tmp_path, alone):
    both = run(FREE, tmp_path / "both", processes=2)[1]
    assert kinds(both) == kinds(alone)
    for one, other in zip(alone["warnings"], both["warnings"], strict=True):
        assert other["time"] == one["time"]
        assert other["value"] == pytest.approx(one["value"], rel=1e-6)


def test_the_same_resumed(tmp_path, alone):
    assert kinds(alone) == [("wall", "disc")]
    at_end = alone["warnings"][0]["time"]
    assert at_end < 0.4
    run(FREE, tmp_path / "part", arguments=["--set", f"time.end={at_end}"])
    assert fsci("resume", tmp_path / "part" / "out", "--set", "time.end=0.4").returncode == 1
    resumed = json.loads((tmp_path / "part" / "out" / "summary.json").read_text())
    assert resumed["warnings"] == alone["warnings"]


def test_the_report_shows_warnings(tmp_path):
    run(FLYING, tmp_path)
    assert fsci("report", tmp_path / "out").returncode == 0
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Warnings" in page
    assert "a and b overlap by" in page
