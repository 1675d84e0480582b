"""Two plates in a channel whose ends leave a slit of 0.002 cells: the grid lets fluid pass, a tight layer does not."""

import numpy as np
import pytest
from programs import fsci

from fsci.running.history import read_history

SLIT = 2e-4
CASE = """\
time: {step: 0.1, end: 0.5}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    inlet: {on: x-, traction: [1, 0]}
    outlet: {on: x+, traction: [0, 0]}
    walls: {on: [y-, y+], slip: true}
structure:
  dynamics: {rho_inf: 0}
  bodies:
    lower:
      mesh: {shape: rectangle, size: [0.03, 0.5], cells: [1, 8], order: 2, origin: [0.957, 0]}
      material: {law: st_venant_kirchhoff, E: 1e8, nu: 0.3, density: 1}
      supports: [{on: bottom, displacement: [0, 0]}]
    upper:
      mesh: {shape: rectangle, size: [0.05, 0.4998], cells: [1, 8], order: 2, origin: [0.943, 0.5002]}
      material: {law: st_venant_kirchhoff, E: 1e8, nu: 0.3, density: 1}
      supports: [{on: top, displacement: [0, 0]}]
contact:
  pairs:
    ends: {slave: {body: lower, on: top}, master: {body: upper, on: bottom}}
coupling: {scheme: SCHEME}
probes:
  flow: {quantity: flow_rate, through: outlet}
  lower: {quantity: force, body: lower}
  upper: {quantity: force, body: upper}
"""


def history(tmp_path, scheme, seal):
    case = CASE.replace("SCHEME", scheme)
    if seal:
        case = case.replace("contact:\n", f"contact:\n  film: {{seal: {seal}}}\n")
    (tmp_path / "case.yaml").write_text(case)
    done = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    return read_history(tmp_path / "out" / "history.csv")


def test_the_slit_alone_leaks(tmp_path):
    """On the grid it leaks more than a million times the 2e-9 m^2/s of lubrication theory."""
    assert history(tmp_path, "monolithic", None)["flow"][-1] > 0.01


@pytest.mark.parametrize(
    ("scheme", "seal"),
    [
        ("monolithic", 0.51 * SLIT),
        pytest.param("monolithic", 5 * SLIT, marks=pytest.mark.slow),
        ("monolithic", 50 * SLIT),
        ("partitioned", SLIT),
    ],
)
def test_a_layer_on_both_ends_closes_it(tmp_path, scheme, seal):
    """Nothing passes, and the plates carry the pressure of 1 Pa over the height of 1 m, whatever the thickness."""
    found = history(tmp_path, scheme, seal)
    assert abs(found["flow"][-1]) < 1e-6
    assert found["lower.x"][-1] + found["upper.x"][-1] == pytest.approx(1.0, abs=1e-5)
    assert found["lower.x"][-1] == pytest.approx(0.5, abs=0.001 + seal)
    assert np.abs(found["interface.momentum"]).max() < 1e-8
    assert np.abs(found["fluid.mass"]).max() < 1e-9
