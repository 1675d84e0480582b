"""Dry contact in a fluid below zero has no state, open or closed: the failure says so, and wetted contact has one."""

from __future__ import annotations

import pytest
from advised import require_explained

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FAILED, FINISHED, run_case
from solvers.api import FailureKind

#: A block pressed on the floor by 5 Pa, in water at rest whose pressure falls to -10 Pa.
BLOCK = """\
title: A block under suction
time: {{step: 0.1, end: 1}}
fluid:
  density: 1
  viscosity: 1
  element: q1q1
  scheme: backward_euler
  grid: {{from: [0, 0], to: [1, 1], cells: [10, 10]}}
  patches:
    top: {{on: y+, traction: [0, "{pull}*ramp(t, 0, 0.6)"]}}
    walls: {{on: [x-, x+, y-], slip: true}}
structure:
  dynamics: {{rho_inf: 0}}
  bodies:
    block:
      mesh: {{shape: rectangle, size: [0.33, 0.37], cells: [3, 3], origin: [0.335, 0]}}
      material: {{law: neo_hooke, E: 1000, nu: 0, density: 1}}
      supports: [{{at: [0.335, 0.37], displacement: [0, null]}}]
      tractions: [{{on: top, value: [0, -5]}}]
contact:
  film: {{zone: {zone}}}
  obstacles:
    floor: {{mesh: {{shape: rectangle, size: [3, 0.2], cells: [1, 1], origin: [-0.5, -0.2]}}, on: top}}
  pairs:
    floor: {{slave: {{body: block, on: bottom}}, master: {{obstacle: floor}}}}
coupling: {{scheme: {scheme}}}
output: {{fields_every: 0}}
"""


def run(folder, scheme="monolithic", **settings):
    (folder / "case.yaml").write_text(BLOCK.format(scheme=scheme, **settings))
    return run_case(load_case(folder / "case.yaml"), folder / "run")


@pytest.mark.parametrize("scheme", ["monolithic", pytest.param("partitioned", marks=pytest.mark.slow)])
def test_without_a_state_the_failure_says_why(tmp_path, capsys, scheme):
    assert run(tmp_path, scheme, zone="dry", pull=10) == FAILED
    said = capsys.readouterr()
    words = said.out + said.err
    assert "below zero pulls at bodies that are dry where they touch" in words
    assert "'contact.film.zone: wetted' gives closed contact the pressure around it" in words
    assert "'contact.film.roughness' lets fluid between flat surfaces that part" in words
    require_explained(tmp_path / "run", FailureKind.SUCTION)


@pytest.mark.parametrize(("zone", "pull"), [("wetted", 10), ("dry", 3)])
def test_with_a_state_the_run_ends(tmp_path, zone, pull):
    """Wetted contact carries the load of the block alone."""
    assert run(tmp_path, zone=zone, pull=pull) == FINISHED
    if zone == "wetted":
        found = read_history(tmp_path / "run" / "history.csv")
        assert abs(found["contact.floor.y"][-1]) == pytest.approx(5 * 0.33, rel=0.01)
