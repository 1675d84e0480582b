"""Free bodies in a flow with a pivot, a load, and a spring between them: both schemes have the same motion."""

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: One disc hangs on a spring of the other one, which a growing moment turns about a point beside its centre.
JOINTED = """\
title: two discs on a spring in a fluid, a lever
time: {step: 0.02, end: 0.08}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  gravity: [0, -5]
  grid: {from: [0, 0], to: [1.4, 1], cells: [14, 10]}
  patches:
    walls: {on: [x-, x+, y-, y+], no_slip: true}
  dynamics: {rho_inf: 0.8}
  bodies:
    one:
      mesh: {shape: disc, radius: 0.17, translate: [0.35, 0.55], cells: [24, 2]}
      free:
        density: 2
        springs: [{at: [0.5, 0.55], stiffness: 30, dashpot: 0.2, to: {body: two, at: [0.8, 0.5]}, length: 0.2}]
    two:
      mesh: {shape: disc, radius: 0.17, translate: [0.95, 0.53], cells: [24, 2]}
      free: {density: 3, pivot: [1.05, 0.6], loads: [{moment: "0.5*t"}]}
coupling: {scheme: monolithic}
probes:
  one: {body: one, quantity: centre}
  two: {body: two, quantity: centre}
  at: {body: two, quantity: displacement, at: [1.05, 0.6]}
solver: {newton: {residual: 1.0e-10}}
"""


def test_both_schemes_move_jointed_bodies_alike(tmp_path):
    """Newton's method takes few iterations with all derivatives; the disc turns about its pivot."""
    path, histories = tmp_path / "case.yaml", []
    path.write_text(JOINTED)
    for name, overrides in (
        ("monolithic", []),
        ("partitioned", [("coupling.scheme", "partitioned"), ("coupling.tolerance", "1e-9")]),
    ):
        assert run_case(load_case(path, overrides), tmp_path / name) == FINISHED
        histories.append(read_history(tmp_path / name / "history.csv"))
    one, two = histories
    assert one["iterations"].max() <= 4
    for column in ("one.x", "one.y", "two.x", "two.y"):
        assert one[column] == pytest.approx(two[column], rel=1e-9)
    assert np.abs(one["at.x"]).max() == np.abs(one["at.y"]).max() == 0.0
    arms = one["two.x"] - 1.05, one["two.y"] - 0.6
    assert np.hypot(*arms) == pytest.approx(np.hypot(0.1, 0.07), rel=1e-12)
    assert one["two.y"][-1] > 0.53 + 1e-3
    assert one["interface.momentum"].max() < 1e-8
