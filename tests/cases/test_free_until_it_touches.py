"""Statics of a block that is pushed over a gap against a wall: its load, or words where it meets none."""

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


@pytest.mark.parametrize(("old", "new"), [
    ("time:", "time:"),
    ("origin: [1.05, -1]", "origin: [1.1, -1]"),
    ("origin: [1.05, -1]", "origin: [1.9, -1]"),
    ("size: [1, 1], cells: [2, 2]", "size: [1, 1], cells: [9, 8]"),
    ("cells: [2, 2]", "cells: [3, 3], order: 2"),
    ("cells: [2, 2]", "cells: [4, 3], cell: tri"),
    ("{slave: {body: block, on: right}, master: {obstacle: wall}}",
     "{slave: {body: block, on: right}, master: {obstacle: wall}, friction: {coefficient: 0.3}}"),
    ("step: 0.5", "step: 0.25"),
])  # fmt: skip
def test_it_reaches_the_wall_and_hands_its_load_over(tmp_path, old, new):
    """The node that is nearest is tried, however far it is in cells: statics has an answer once it touches."""
    assert old in CASE
    done = run(tmp_path, CASE.replace(old, new))
    assert done.returncode == 0, done.stderr
    history = read_history(tmp_path / "out" / "history.csv")
    assert history["contact.wall.x"] == pytest.approx(-100.0 * history["time"], rel=1e-9)


def test_on_two_processes(tmp_path):
    (tmp_path / "case.yaml").write_text(CASE)
    assert fsci("run", tmp_path, "-o", tmp_path / "out", processes=2).returncode == 0
    assert read_history(tmp_path / "out" / "history.csv")["contact.wall.x"] == pytest.approx([-50.0, -100.0], rel=1e-9)


def test_what_goes_away_has_no_place_and_is_told_what_helps(tmp_path):
    done = run(tmp_path, CASE.replace("100*t", "-100*t"))
    assert done.returncode == 1
    words = done.stdout + done.stderr
    assert "is far larger than the body, 1: is a body not supported? One that is free until it touches needs" in words
    assert "weak 'springs', a pair with 'adjust', or 'dynamics'" in words


def test_a_way_of_many_sizes_is_a_leap(tmp_path):
    done = run(tmp_path, CASE.replace("origin: [1.05, -1]", "origin: [9, -1]"))
    assert done.returncode == 1
    words = "leap: block moved by 8 in one step, 8 times its size: it may have passed through what should hold it, "
    assert words + "or nothing holds it; take a smaller 'step', or support it" in done.stdout + done.stderr


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
