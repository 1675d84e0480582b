"""Statics of a block that is pushed over a gap against a wall: words without a hold, its load with one."""

import pytest
from programs import fsci

from fsci.running.history import read_history

CASE = """
time: {step: 0.5, end: 1, retry: {halvings: 1}}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [2, 2]}
      material: {law: neo_hooke, E: 1e4, nu: 0.3}
      supports: [{on: bottom, displacement: [null, 0]}]
      tractions: [{on: left, value: ["100*t", 0]}]
contact:
  obstacles:
    wall: {mesh: {shape: rectangle, size: [1, 3], cells: [1, 1], origin: [1.05, -1]}, on: left}
  pairs:
    wall: {slave: {body: block, on: right}, master: {obstacle: wall}}
output: {fields_every: 0}
"""


def run(folder, text):
    path = folder / "case.yaml"
    path.write_text(text)
    return fsci("run", path, "-o", folder / "out")


def test_statics_has_no_place_for_it_and_says_what_helps(tmp_path):
    done = run(tmp_path, CASE)
    assert done.returncode == 1
    words = done.stdout + done.stderr
    assert "is far larger than the body, 1: is a body not supported? One that is free until it touches needs" in words
    assert "weak 'springs', a pair with 'adjust', or 'dynamics'" in words


@pytest.mark.parametrize(("old", "new", "carried"), [
    ("tractions:", "springs: [{on: bottom, stiffness: 0.1}]\n      tractions:", 0.1 * 0.055),
    ("{obstacle: wall}", "{obstacle: wall}, adjust: 0.06", 0.0),
])  # fmt: skip
def test_what_helps_hands_its_load_to_the_wall(tmp_path, old, new, carried):
    """A spring takes its stiffness times the mean motion of the bottom: the gap and half of the compression."""
    done = run(tmp_path, CASE.replace(old, new))
    assert done.returncode == 0, done.stderr
    force = read_history(tmp_path / "out" / "history.csv")["contact.wall.x"][-1]
    assert force == pytest.approx(carried - 100.0, abs=1e-4)
