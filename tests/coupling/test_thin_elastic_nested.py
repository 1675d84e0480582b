"""Elastic bodies thinner than a cell in nested cells that follow them."""

import numpy as np
import pytest
from programs import fsci

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import run_case

WALL = """\
time: {{step: 0.1, end: 2}}
fluid:
  density: 1
  viscosity: 0.01
  scheme: backward_euler
  element: {element}
  grid: {{from: [0, 0], to: [3, 1], cells: [15, 5], refine: [{{around: plate, layers: 4, level: 1}}]}}
  patches:
    inlet: {{on: x-, traction: ["min(t,1)", 0]}}
    outlet: {{on: x+, traction: [0, 0]}}
    walls: {{on: [y-, y+], slip: true}}
structure:
  dynamics: {{rho_inf: 0.5, damping: {{stiffness: 0.01}}}}
  bodies:
    plate:
      mesh: {{shape: rectangle, size: [0.02, 1], cells: [1, 10], order: 2, origin: [1.537, 0]}}
      material: {{law: st_venant_kirchhoff, E: 1e8, nu: 0.3, density: 1}}
      supports: [{{on: [bottom, top], displacement: [0, 0]}}]
coupling: {{scheme: monolithic}}
probes:
  flow: {{quantity: flow_rate, through: outlet}}
  mid: {{body: plate, quantity: displacement, at: [1.537, 0.5]}}
  left: {{quantity: pressure, at: [1.51, 0.52]}}
  right: {{quantity: pressure, at: [1.59, 0.52]}}
"""


@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow)])
def test_wall_that_closes_a_channel(tmp_path, element):
    """In the end it rests: pressures 1 and 0 beside it, and the deflection of the wall alone (`test_thin_elastic`)."""
    (tmp_path / "case.yaml").write_text(WALL.format(element=element))
    assert run_case(load_case(tmp_path), tmp_path / "out") == 0
    history = read_history(tmp_path / "out" / "history.csv")
    assert abs(history["flow"][-1]) < 1e-9
    assert history["left"][-1] == pytest.approx(1.0, abs=1e-6)
    assert history["right"][-1] == pytest.approx(0.0, abs=1e-6)
    assert history["mid.x"][-1] == pytest.approx(3.425697e-5, rel=1e-4)


FLAPS = """\
time: {step: 0.02, end: 0.12}
fluid:
  density: 1
  viscosity: 0.02
  element: q1q1
  grid:
    from: [0, 0]
    to: [2.4, 1]
    cells: [12, 5]
    refine: [{around: low, layers: 4, level: 2}, {around: high, layers: 4, level: 2}]
  patches:
    inlet: {on: x-, velocity: ["6*y*(1-y)*min(t/0.1,1)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    low: &flap
      mesh: {shape: rectangle, size: [0.03, 0.4], cells: [1, 6], order: 2, origin: [0.83, 0]}
      material: {law: neo_hooke, E: 2e4, nu: 0.3, density: 5}
      supports: [{on: bottom, displacement: [0, 0]}]
    high:
      <<: *flap
      mesh: {shape: rectangle, size: [0.03, 0.4], cells: [1, 6], order: 2, origin: [1.27, 0.6]}
      supports: [{on: top, displacement: [0, 0]}]
coupling: {scheme: monolithic}
solver: {newton: {residual: 1e-11}}
probes:
  low: {body: low, quantity: displacement, at: [0.83, 0.4]}
  high: {body: high, quantity: displacement, at: [1.27, 0.6]}
  force: {quantity: force, body: low}
  rate: {quantity: flow_rate, through: outlet}
"""
COLUMNS = ("low.x", "low.y", "high.x", "force.x", "rate", "fluid.mass")


def flaps(folder, end, processes, resumed=None):
    folder.mkdir()
    (folder / "case.yaml").write_text(FLAPS)
    done = fsci("run", folder, "-o", folder / "out", "--set", f"time.end={end}", processes=processes)
    assert done.returncode == 0, done.stdout + done.stderr
    if resumed is not None:
        done = fsci("resume", folder / "out", "--set", "time.end=0.12", processes=resumed)
        assert done.returncode == 0, done.stdout + done.stderr
    return read_history(folder / "out" / "history.csv")


@pytest.mark.slow
def test_two_flaps(tmp_path):
    """A resumed run is the same bit for bit, and two processes give what one does."""
    whole = flaps(tmp_path / "whole", 0.12, 1)
    again, two = flaps(tmp_path / "again", 0.06, 1, 1), flaps(tmp_path / "two", 0.06, 2, 2)
    for name in COLUMNS:
        assert np.array_equal(again[name], whole[name]), name
        assert np.allclose(two[name], whole[name], rtol=1e-8, atol=1e-11), name
    assert np.abs(whole["low.x"]).max() > 0.02
