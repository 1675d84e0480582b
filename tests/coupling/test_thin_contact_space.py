"""Elastic flaps of 0.3 cells in a duct in 3D: they press on each other and seal it."""

import numpy as np
import pytest
from programs import fsci

from fsci.running.history import read_history

#: what iterations leave over does not tell processes apart
EXACT = ("--set", "solver.newton.residual=1e-10")

CASE = """\
time: {step: 0.05, end: 1.4}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0, 0], to: [2, 0.3, 1], cells: [20, 3, 10]}
  patches:
    inlet: {on: x-, traction: ["ramp(t,0,1)", 0, 0]}
    outlet: {on: x+, traction: [0, 0, 0]}
    walls: {on: [y-, y+, z-, z+], slip: true}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    lower:
      mesh: {shape: box, size: [0.03, 0.3, 0.64], cells: [1, 3, 13], order: 2, origin: [0.937, 0, 0]}
      material: {law: st_venant_kirchhoff, E: 2.5e5, nu: 0.3, density: 1}
      supports: [{on: bottom, displacement: [0, 0, 0]}, {on: [front, back], symmetry: true}]
    upper:
      mesh: {shape: box, size: [0.03, 0.3, 0.63], cells: [1, 2, 10], order: 2, origin: [0.977, 0, 0.37]}
      material: {law: st_venant_kirchhoff, E: 3e8, nu: 0.3, density: 1}
      supports: [{on: top, displacement: [0, 0, 0]}, {on: [front, back], symmetry: true}]
contact:
  pairs:
    flaps: {slave: {body: lower, on: right}, master: {body: upper, on: left}}
coupling: {scheme: monolithic}
probes:
  flow: {quantity: flow_rate, through: outlet}
  lower: {quantity: force, body: lower}
  upper: {quantity: force, body: upper}
"""


@pytest.mark.slow
def test_flap_that_closes_a_duct(tmp_path):
    """It touches the stiff one within a step. Then nothing passes, and both carry the pressure."""
    (tmp_path / "case.yaml").write_text(CASE)
    done = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    history = read_history(tmp_path / "out" / "history.csv")
    assert len(history["time"]) == 28  # no step is repeated
    # in the step of the first contact, whose solution is looked for twice since unknowns come and go; 3 in others
    assert history["iterations"].max() <= 22
    assert (history["contact.active"][history["time"] > 0.9] > 0).all()
    assert history["flow"].max() > 1e-3
    assert abs(history["flow"][-1]) < 1e-6
    assert history["lower.x"][-1] + history["upper.x"][-1] == pytest.approx(0.3, abs=3e-5)
    assert np.abs(history["fluid.mass"]).max() < 1e-9
    assert np.abs(history["interface.momentum"]).max() < 1e-8


@pytest.mark.slow(seconds=120)
def test_resumed_in_contact_and_on_two_processes(tmp_path):
    """A run that goes on two steps after the first contact is the same bit for bit; on two processes to 1e-8."""
    (tmp_path / "case.yaml").write_text(CASE)
    found = {}
    for name, processes, end in (("whole", 1, 1.0), ("resumed", 1, 0.9), ("two", 2, 1.0)):
        done = fsci("run", tmp_path, "-o", tmp_path / name, "--set", f"time.end={end}", *EXACT, processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        if name == "resumed":
            done = fsci("resume", tmp_path / name, "--set", "time.end=1.0")
            assert done.returncode == 0, done.stdout + done.stderr
        found[name] = read_history(tmp_path / name / "history.csv")
    assert found["whole"]["contact.active"][-1] > 0
    for column in ("flow", "lower.x", "upper.x"):
        whole = found["whole"][column]
        assert np.array_equal(found["resumed"][column], whole)
        assert np.allclose(found["two"][column], whole, rtol=1e-8, atol=1e-8 * np.abs(whole).max())
