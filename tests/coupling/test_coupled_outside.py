"""Walls in 3D, thinner than a cell, that end on faces of the box, with fluid on one side: a tube, a membrane."""

import numpy as np
import pytest
from scipy.optimize import brentq
from test_coupled_run import run

TUBE = """\
title: a tube
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  scheme: backward_euler
  grid: {from: [-1.2, -1.2, 0], to: [1.2, 1.2, 2], cells: [5, 5, 3]}
  patches:
    inlet: {on: z-, traction: [0, 0, 0.002]}
    outlet: {on: z+, traction: [0, 0, 0]}
    outside: {on: [x-, x+, y-, y+], no_slip: true}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    wall:
      mesh: {shape: tube, inner_radius: 1, outer_radius: 1.09, height: 2, cells: [16, 1, 3]}
      material: {law: st_venant_kirchhoff, E: 20, nu: 0.3, density: 1}
      supports: [{on: [bottom, top], symmetry: true}]
coupling: {wetted: {wall: inner}, dry_side: {wall: outside}}
probes:
  inlet: {quantity: flow_rate, through: inlet}
  outlet: {quantity: flow_rate, through: outlet}
  volume: {field: fluid, quantity: volume}
"""
#: area within 16 parabolas through corners of the circle and points amid them: two thirds of each arc's height
AREA = 8 * np.sin(np.pi / 8) + 16 * (2 / 3) * (2 * np.sin(np.pi / 16)) * (1 - np.cos(np.pi / 16))


def test_what_flows_in_widens_the_tube(tmp_path):
    """The volume at the start is that within the curved surfaces; it grows by what flows in, and nothing is lost."""
    history = run(TUBE, tmp_path)
    volume, flow = history["volume"], history["inlet"] + history["outlet"]
    assert volume[0] + 0.1 * flow[0] == pytest.approx(2 * AREA, rel=1e-9)
    assert np.diff(volume) == pytest.approx(-0.1 * flow[1:], rel=1e-3)
    assert np.abs(history["fluid.mass"]).max() < 1e-11
    assert np.abs(history["interface.momentum"]).max() < 1e-9


#: a block of 0.55 cells across the box, half way up, with fluid above it and none below
COLUMN = """\
title: a column of fluid on an elastic block
time: {step: 1, end: 1}
fluid:
  density: 1000
  viscosity: 1
  element: q1q1
  scheme: steady
  flow: stokes
  gravity: [0, 0, -10]
  grid: {from: [0, 0, 0], to: [1, 0.5, 1], cells: [4, 2, 5]}
  patches:
    sides: {on: [x-, x+, y-, y+, z-], slip: true}
    top: {on: z+, traction: [0, 0, 0]}
structure:
  bodies:
    block:
      mesh: {shape: box, size: [1, 0.5, 0.11], cells: [3, 2, 1], cell: tet, translate: [0, 0, 0.39]}
      material: {law: st_venant_kirchhoff, E: 1e5, nu: 0}
      supports: [{on: bottom, displacement: [0, 0, 0]}, {on: [left, right, front, back], symmetry: true}]
coupling: {wetted: {block: top}, dry_side: {block: outside}}
probes:
  top: {quantity: displacement, at: [0.5, 0.25, 0.5]}
  force: {quantity: force}
  volume: {field: fluid, quantity: volume}
  pressure: {quantity: pressure, at: [0.4, 0.2, 0.7]}
solver: {newton: {residual: 1.0e-11}}
"""


def test_column_on_a_block(tmp_path):
    """One dimension: E/2 (s^2 - 1) s = -rho g H with the stretch s and the height H = 0.61 - 0.11 s, to rounding."""
    history = run(COLUMN, tmp_path)
    stretch = brentq(lambda s: 0.5e5 * (s**2 - 1) * s + 1e4 * (0.61 - 0.11 * s), 0.9, 1.0, xtol=1e-15)
    height = 0.61 - 0.11 * stretch
    expected = {"top.z": 0.11 * (stretch - 1), "force.z": -5e3 * height, "volume": 0.5 * height, "pressure": 3000.0}
    for name, value in expected.items():
        assert history[name][-1] == pytest.approx(value, rel=1e-10), name
    assert abs(history["fluid.mass"][-1]) < 1e-12
