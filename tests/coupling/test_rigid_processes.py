"""Contact between free rigid bodies on one to three processes, with fluid and without."""

from __future__ import annotations

import numpy as np
import pytest
from programs import fsci

from fsci.running.history import read_history

#: One disc falls on another one, which lies on the floor, a third of a cell beside it; friction turns both.
WET = """\
time: {step: 0.02, end: 0.16}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 0.8], cells: [12, 10]}
  patches: {top: {on: y+, outflow: true}, walls: {on: [x-, x+, y-], no_slip: true}}
  bodies:
    one: {mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.528, 0.151]}, free: {density: 8, gravity: [0, -10]}}
    two: {mesh: {shape: disc, radius: 0.12, cells: [20, 1], translate: [0.5, 0.45]}, free: {density: 20, gravity: [0, -10]}}
  dynamics: {rho_inf: 0}
coupling: {}
contact: {friction: {coefficient: 0.3}}
solver: {newton: {residual: 1.0e-12}}
probes:
  one: {body: one, quantity: centre}
  two: {body: two, quantity: centre}
  spin: {body: two, quantity: angular_momentum}
output: {fields_every: 0}
"""  # noqa: E501
DRY = """\
time: {step: 0.02, end: 0.4}
rigid:
  gravity: [0, 0, -10]
  bodies:
    one: {mesh: {shape: sphere, radius: 0.15, cells: [3, 1], translate: [0.528, 0.4, 0.151]}, density: 8}
    two: {mesh: {shape: sphere, radius: 0.12, cells: [3, 1], translate: [0.5, 0.41, 0.45]}, density: 20}
contact:
  friction: {coefficient: 0.3}
  obstacles: {floor: {mesh: {shape: box, size: [2, 2, 0.2], cells: [1, 1, 1], origin: [-1, -1, -0.2]}, on: top}}
probes:
  one: {body: one, quantity: centre}
  two: {body: two, quantity: centre}
  spin: {body: two, quantity: angular_momentum}
output: {fields_every: 0}
"""


@pytest.mark.slow
@pytest.mark.parametrize("text", [pytest.param(WET, id="in a fluid"), pytest.param(DRY, id="dry, in space")])
def test_three_processes(tmp_path, text):
    (tmp_path / "case.yaml").write_text(text)
    found = []
    for processes in (1, 3):
        done = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / str(processes), processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        found.append(read_history(tmp_path / str(processes) / "history.csv"))
    one, three = found
    up = "z" if "one.z" in one else "y"
    names = [name for name in one if name.startswith(("one.", "two.", "spin"))]
    assert one[f"contact.on_two.{up}"].max() > 1.0  # they meet
    for name in names:
        np.testing.assert_allclose(three[name], one[name], rtol=0, atol=1e-10, err_msg=name)
