"""Elastic walls thinner than a cell in 3D."""

import numpy as np
import pytest
from programs import fsci

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import run_case

WALL = """\
time: {step: 0.05, end: 0.15}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0, 0], to: [2, 1, 1], cells: [8, 4, 4]}
  patches:
    inlet: {on: x-, traction: ["min(t,1)", 0, 0]}
    outlet: {on: x+, traction: [0, 0, 0]}
    walls: {on: [y-, y+, z-, z+], slip: true}
structure:
  dynamics: {rho_inf: 0.5, damping: {stiffness: 0.01}}
  bodies:
    plate:
      mesh: {shape: box, size: [0.05, 1, 1], cells: [1, 4, 4], order: 2, origin: [0.96, 0, 0]}
      material: {law: st_venant_kirchhoff, E: 1e4, nu: 0.3, density: 1}
      supports: [{on: [front, back, bottom, top], displacement: [0, 0, 0]}]
coupling: {scheme: monolithic}
probes:
  flow: {quantity: flow_rate, through: outlet}
  mid: {body: plate, quantity: displacement, at: [0.96, 0.5, 0.5]}
  left: {quantity: pressure, at: [0.9, 0.52, 0.5]}
  right: {quantity: pressure, at: [1.1, 0.52, 0.5]}
"""

#: Three edges are free or fixed, the fourth slides along a plane of symmetry.
LEAF = """\
time: {step: 0.05, end: 0.1}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0, 0], to: [1.5, 1.05, 1.35], cells: [10, 7, 9]}
  patches:
    inlet: {on: x-, velocity: ["min(5*t,1)", 0, 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+, z-, z+], slip: true}
structure:
  dynamics: {rho_inf: 0.5, damping: {stiffness: 0.01}}
  bodies:
    leaf:
      mesh: {shape: box, size: [0.03, 0.75, 1.05], cells: [1, 3, 4], order: 2, origin: [0.51, 0, 0]}
      material: {law: st_venant_kirchhoff, E: 4e5, nu: 0.3, density: 1}
      supports: [{on: bottom, displacement: [0, 0, 0]}, {on: front, symmetry: true}]
coupling: {scheme: monolithic}
probes:
  tip: {body: leaf, quantity: displacement, at: [0.51, 0.4, 1.05]}
"""


@pytest.mark.slow
def test_resumed_and_on_two_processes(tmp_path):
    """A run that goes on is the same bit for bit, and on two processes the same to 1e-8."""
    (tmp_path / "case.yaml").write_text(WALL)
    found = {}
    for name, processes, end in (("whole", 1, 0.15), ("resumed", 1, 0.1), ("two", 2, 0.15)):
        done = fsci("run", tmp_path, "-o", tmp_path / name, "--set", f"time.end={end}", processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        if name == "resumed":
            done = fsci("resume", tmp_path / name, "--set", "time.end=0.15")
            assert done.returncode == 0, done.stdout + done.stderr
        found[name] = read_history(tmp_path / name / "history.csv")
    for column in ("mid.x", "flow", "left", "right"):
        whole = found["whole"][column]
        assert np.array_equal(found["resumed"][column], whole)
        assert np.allclose(found["two"][column], whole, rtol=1e-8, atol=1e-8 * np.abs(whole).max())
    assert np.abs(found["whole"]["fluid.mass"]).max() < 1e-9


@pytest.mark.slow
def test_leaflet_that_bends(tmp_path):
    """Mass and momentum balance while its cells change."""
    (tmp_path / "case.yaml").write_text(LEAF)
    assert run_case(load_case(tmp_path), tmp_path / "out") == 0
    history = read_history(tmp_path / "out" / "history.csv")
    assert history["tip.x"][-1] > 0.04
    assert np.abs(history["fluid.mass"]).max() < 1e-9
    assert np.abs(history["interface.momentum"]).max() < 1e-8


def test_leaf_with_multigrid(tmp_path):
    """It bends as with the direct solver, with at most one more Newton step per step; multigrid does not stall."""
    (tmp_path / "case.yaml").write_text(LEAF.replace("cells: [10, 7, 9]", "cells: [8, 6, 7]"))
    found = {}
    for method in ("iterative", "direct"):
        words = (
            "--set",
            f"solver.linear.method={method}",
            "--set",
            "solver.linear.tolerance=1e-9",
            "--set",
            "time.end=0.05",
        )
        done = fsci("run", tmp_path, "-o", tmp_path / method, *words)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "from here on" not in done.stdout
        found[method] = read_history(tmp_path / method / "history.csv")
    for column in ("tip.x", "tip.z"):
        with_multigrid, exact = (history[column] for history in found.values())
        assert np.abs(with_multigrid - exact).max() < 1e-6 * np.abs(exact).max()
    assert (found["iterative"]["iterations"] <= found["direct"]["iterations"] + 1).all()
