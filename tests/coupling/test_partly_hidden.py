"""Thin plates that begin in the wall of a tube: a facet counts with the part of it that is in the fluid."""

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import run_case

CASE = """\
time: {step: 0.05, end: 0.1}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  scheme: backward_euler
  grid: {from: [-1.1, -1.1, 0], to: [1.1, 1.1, 2], cells: [8, 8, 7]}
  patches:
    inlet: {on: z-, traction: [0, 0, 1]}
    outlet: {on: z+, traction: [0, 0, 0]}
    walls: {on: [x-, x+, y-, y+], no_slip: true}
  bodies:
    tube:
      mesh: {shape: tube, inner_radius: 1, outer_radius: 1.7, height: 5, cells: [24, 1, 6], translate: [0, 0, -1.3]}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    plate:
      mesh: {shape: box, size: [2.3, 2.3, 0.08], cells: [5, 5, 1], origin: [-1.15, -1.15, 1.02]}
      material: {law: st_venant_kirchhoff, E: 1e6, nu: 0.3, density: 1}
      supports: [{on: [left, right, front, back], displacement: [0, 0, 0]}]
coupling: {scheme: monolithic}
probes:
  flow: {quantity: flow_rate, through: outlet}
  plate: {quantity: force, body: plate}
  speed: {body: plate, quantity: displacement, at: [0, 0, 1.02]}
solver: {newton: {residual: 1.0e-11}}
"""


@pytest.mark.slow
def test_plate_that_closes_a_tube(tmp_path):
    """Half of its outer facets have their middle in the tube's wall. They are no holes: the volume balances."""
    (tmp_path / "case.yaml").write_text(CASE)
    assert run_case(load_case(tmp_path), tmp_path / "out") == 0
    history = read_history(tmp_path / "out" / "history.csv")
    assert np.abs(history["fluid.mass"]).max() < 1e-10
    assert np.abs(history["interface.momentum"]).max() < 1e-8
