"""Elastic and free bodies that turn pump nothing, and keep the fluid that they enclose."""

from __future__ import annotations

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: A heavy ring full of water that spins freely, by 0.06 in a step.
RING = """\
title: A spinning ring full of water
time: {{step: 0.02, end: 0.2}}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  scheme: {scheme}
  grid: {{from: [-0.5, -0.5], to: [0.5, 0.5], cells: [24, 24]}}
  patches:
    open: {{on: y+, traction: [0, 0]}}
    walls: {{on: [x-, x+, y-], slip: true}}
{ring}
coupling: {{scheme: {coupling}}}
probes:
  u: {{field: structure, quantity: displacement, at: [0.2, 0]}}
  pressure: {{quantity: pressure, at: [0, 0]}}
  out: {{quantity: flow_rate, through: open}}
output: {{fields_every: 0}}
solver: {{newton: {{residual: 1.0e-11}}}}
"""

ELASTIC = """\
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    ring:
      mesh: {shape: ring, inner_radius: 0.2, outer_radius: 0.3, cells: [32, 2], order: 2}
      material: {law: neo_hooke, E: 5000, nu: 0.3, density: 10}
      initial_velocity: ["-3*y", "3*x"]"""

#: A thick elastic ring, turned by its inside around its middle; what it encloses is not wetted.
ROLL = """\
title: A roll that is turned by its hub
time: {{step: 0.02, end: 0.3}}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: {scheme}
  grid: {{from: [-0.5, -0.5], to: [0.5, 0.5], cells: [20, 20]}}
  patches:
    open: {{on: y+, traction: [0, 0]}}
    walls: {{on: [x-, x+, y-], no_slip: true}}
structure:
  dynamics: {{rho_inf: 0.8}}
  bodies:
    roll:
      mesh: {{shape: ring, inner_radius: 0.1, outer_radius: 0.3, cells: [32, 3], order: 2}}
      material: {{law: neo_hooke, E: 1e6, nu: 0.3, density: 2}}
      supports:
        - on: inner
          displacement: ["x*(cos(th)-1) - y*sin(th)", "x*sin(th) + y*(cos(th)-1)"]
coupling: {{scheme: monolithic, wetted: {{roll: outer}}}}
probes:
  out: {{quantity: flow_rate, through: open}}
output: {{fields_every: 0}}
solver: {{newton: {{residual: 1.0e-11}}}}
"""


def history(folder, text):
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "run") == FINISHED
    return read_history(folder / "run" / "history.csv")


@pytest.mark.parametrize(
    ("scheme", "coupling"),
    [
        ("backward_euler", "monolithic"),
        pytest.param("bdf2", "monolithic", marks=pytest.mark.slow),
        pytest.param("bdf2_optimized", "monolithic", marks=pytest.mark.slow),
        pytest.param("backward_euler", "partitioned", marks=pytest.mark.slow),
    ],
)
def test_ring_keeps_its_water(tmp_path, scheme, coupling):
    """With the velocity of the vertices alone it loses 3 % of it, and the pressure is -30 Pa (backward Euler)."""
    found = history(tmp_path, RING.format(scheme=scheme, coupling=coupling, ring=ELASTIC))
    volume = np.asarray(found["fluid.pocket_1"])
    assert np.abs(volume / volume[0] - 1.0).max() < (1e-9 if coupling == "monolithic" else 1e-5)
    assert np.abs(found["pressure"]).max() < 20.0
    assert np.abs(found["fluid.mass"]).max() < (1e-9 if coupling == "monolithic" else 1e-5)


@pytest.mark.parametrize("scheme", [pytest.param("backward_euler", marks=pytest.mark.slow), "bdf2"])
def test_roll_turned_by_its_hub_pumps_nothing(tmp_path, scheme):
    """The velocities of vertices alone pump pi R^2 omega^2 dt = 0.05 m^2/s with backward Euler."""
    text = ROLL.format(scheme=scheme).replace("th)", "3*ramp(t, 0, 0.1)*t)")
    assert np.abs(history(tmp_path, text)["out"][-1]) < 1e-3
