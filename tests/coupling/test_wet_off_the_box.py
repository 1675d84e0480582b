"""Surfaces that begin on the boundary of the box: the fluid reaches them as soon as they leave it."""

from __future__ import annotations

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: A plug is drawn off the upper wall of a channel.
PLUG = """\
title: A plug leaves its wall
time: {{step: 0.1, end: 0.6}}
fluid:
  density: 1
  viscosity: 0.1
  scheme: backward_euler
  element: {element}
  grid: {{from: [0, 0], to: [3, 1], cells: [30, 10]}}
  patches:
    in: {{on: x-, traction: ["ramp(t, 0, 0.3)", 0]}}
    out: {{on: x+, outflow: true}}
    walls: {{on: [y-, y+], no_slip: true}}
structure:
  dynamics: {{rho_inf: 0.5}}
  bodies:
    plug:
      mesh: {{shape: rectangle, size: [0.5, 0.5], cells: [4, 4], origin: [0.62, 0.5]}}
      material: {{law: neo_hooke, E: 500, nu: 0.3, density: 1}}
      supports: [{{on: top, displacement: [0, "-0.5*ramp(t, 0.1, 0.6)"]}}]
coupling: {{scheme: {scheme}{wetted}}}
probes:
  in: {{quantity: flow_rate, through: in}}
  out: {{quantity: flow_rate, through: out}}
  force: {{field: fluid, body: plug, quantity: force}}
output: {{fields_every: 0}}
solver: {{newton: {{residual: 1e-10}}}}  # the loss of fluid is that of the method, not of the iteration
"""
COLUMNS = ("in", "out", "force.x", "force.y", "fluid.mass")


def history(folder, **settings):
    (folder / "case.yaml").write_text(PLUG.format(**settings))
    assert run_case(load_case(folder / "case.yaml"), folder / "run") == FINISHED
    found = read_history(folder / "run" / "history.csv")
    return np.stack([found[name] for name in COLUMNS])


@pytest.mark.parametrize(
    ("scheme", "element"),
    [
        ("monolithic", "q1q1"),
        pytest.param("partitioned", "q1q1", marks=pytest.mark.slow),
        pytest.param("monolithic", "q2q1", marks=pytest.mark.slow),
    ],
)
def test_a_plug_leaves_its_wall(tmp_path, scheme, element):
    """It swallows nothing: half of the flow vanished in its upper side. All of its surface is wet, as if named so."""
    found = history(tmp_path, scheme=scheme, element=element, wetted="")
    assert np.abs(found[4]).max() < 1e-7 * np.abs(found[1]).max()
    (tmp_path / "named").mkdir()
    named = ", wetted: {plug: [left, right, bottom, top]}"
    assert found == pytest.approx(history(tmp_path / "named", scheme=scheme, element=element, wetted=named), abs=1e-12)
