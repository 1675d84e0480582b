"""Scenes that first-time users bring, in small: each against values by hand."""

import numpy as np
import pytest
from programs import fsci

from fsci.running.history import read_history

BEAM = """
time: {step: 1, end: 1}
structure:
  bodies:
    beam:
      mesh: {shape: rectangle, size: [1, 0.1], cells: [10, 2], order: 2}
      material: {law: st_venant_kirchhoff, E: 1e6, nu: 0}
      supports: [{on: left, displacement: [0, 0]}]
      tractions: [{on: right, value: [0, -0.1]}]
probes: {tip: {quantity: displacement, on: right}, clamp: {quantity: reaction, on: left}}
"""

CHANNEL = """
time: {step: 0.1, end: 0.4}
fluid:
  density: 3
  viscosity: 1
  scheme: backward_euler
  body_force: [6, 0]
  grid: {from: [0, 0], to: [1, 1], cells: [6, 5]}
  patches: {ends: {on: [x-, x+], periodic: true}, walls: {on: [y-, y+], slip: true}}
probes:
  u: {quantity: velocity, box: [[0.13, 0.1], [0.71, 0.55]]}
  energy: {quantity: kinetic_energy, box: [[0.13, 0.1], [0.71, 0.55]]}
  volume: {quantity: volume, box: [[0.13, 0.1], [0.71, 0.55]]}
  fastest: {quantity: speed}
  slowest: {quantity: speed, extreme: least, box: [[0.13, 0.1], [0.71, 0.55]]}
  highest: {quantity: pressure, extreme: largest, box: [[0.13, 0.1], [0.71, 0.55]]}
"""

DISCS = """
time: {step: 0.01, end: 1.5}
rigid:
  gravity: [0, -10]
  bodies:
    a: {mesh: {shape: disc, radius: 0.1, cells: [32, 1], translate: [0.2, 0.2]}, density: 100}
    b: {mesh: {shape: disc, radius: 0.1, cells: [32, 1], translate: [0.45, 0.25]}, density: 100}
    c: {mesh: {shape: disc, radius: 0.12, cells: [32, 1], translate: [0.32, 0.5]}, density: 100}
    d: {mesh: {shape: disc, radius: 0.08, cells: [32, 1], translate: [0.5, 0.6]}, density: 100}
    e: {mesh: {shape: disc, radius: 0.1, cells: [32, 1], translate: [0.15, 0.75]}, density: 100}
contact:
  friction: {coefficient: 0.3}
  restitution: 0.3
  obstacles:
    floor: {mesh: {shape: rectangle, size: [0.8, 0.1], cells: [1, 1], origin: [-0.1, -0.1]}}
    left: {mesh: {shape: rectangle, size: [0.1, 1], cells: [1, 1], origin: [-0.1, 0]}}
    right: {mesh: {shape: rectangle, size: [0.1, 1], cells: [1, 1], origin: [0.6, 0]}}
"""


def run(folder, text, processes=1):
    (folder / "case.yaml").write_text(text)
    found = fsci("run", folder / "case.yaml", "-o", folder / "out", processes=processes)
    assert found.returncode == 0, found.stdout + found.stderr
    return read_history(folder / "out" / "history.csv"), found.stdout


def test_beam(tmp_path):
    """F L^3 / (3 E I) + 6/5 F L / (G A)."""
    history, _ = run(tmp_path, BEAM)
    exact = 0.01 / (3 * 1e6 * 1e-3 / 12) + 1.2 * 0.01 / (0.5e6 * 0.1)
    assert history["tip.y"][-1] == pytest.approx(-exact, rel=0.002)
    assert history["clamp.y"][-1] == pytest.approx(0.01, rel=1e-8)


@pytest.mark.parametrize("processes", [1, 2])
def test_box_in_a_flow_that_speeds_up(tmp_path, processes):
    """u = t f / rho; faces of the box are within cells."""
    history, _ = run(tmp_path, CHANNEL, processes)
    t, volume = np.array(history["time"]), 0.58 * 0.45
    assert history["u.x"] == pytest.approx(2 * t, rel=1e-7)
    assert history["u.y"] == pytest.approx(0 * t, abs=1e-7)
    assert history["fastest"] == pytest.approx(2 * t, rel=1e-7)
    assert history["slowest"] == pytest.approx(2 * t, rel=1e-7)
    assert history["highest"] == pytest.approx(0 * t, abs=1e-6)
    for name, (low, high) in (("slowest", (0.13, 0.71)), ("highest", (0.13, 0.71)), ("fastest", (0, 1))):
        assert ((low <= history[f"{name}.place.x"]) & (history[f"{name}.place.x"] <= high)).all()
    assert history["volume"] == pytest.approx(volume + 0 * t, rel=1e-10)
    assert history["energy"] == pytest.approx(0.5 * 3 * volume * 4 * t**2, rel=1e-6)


@pytest.mark.slow
def test_discs_settle_in_a_box(tmp_path):
    """No step is repeated; at the end discs are at rest: the contact force on each is its weight."""
    history, text = run(tmp_path, DISCS)
    assert "repeated" not in text
    for name, radius in zip("abcde", (0.1, 0.1, 0.12, 0.08, 0.1), strict=True):
        weight = 1000 * 16 * radius**2 * np.sin(2 * np.pi / 32)
        assert history[f"contact.on_{name}.y"][-1] == pytest.approx(weight, rel=0.01)
