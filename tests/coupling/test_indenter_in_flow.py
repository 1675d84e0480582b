"""A disc pressed into a block in a fluid and drawn back, with velocities of second order."""

from __future__ import annotations

import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: It is pressed in until t = 2.
SOLID = """\
title: Indenter
time: {{step: {step}, end: {end}}}
structure:
  {dynamics}
  bodies:
    block:
      mesh: {{shape: rectangle, size: [1.6, 0.5], cells: [20, 6], order: 2, origin: [-0.8, 0]}}
      material: {{law: neo_hooke, E: 1000, nu: 0.3, density: 1}}
      supports: [{{on: bottom, displacement: [0, 0]}}]
probes:
  clamp: {{quantity: reaction, on: bottom}}
output: {{fields_every: 0}}
"""
DISC = "mesh: {shape: disc, radius: 0.25, cells: [96, 1], translate: [0, 0.84]}"
WAY = '[0, "-0.24*ramp(t, 0, 2) + 0.24*ramp(t, 2, 4)"]'
ALONE = f"""\
contact:
  obstacles: {{tip: {{{DISC}, on: outer, motion: {WAY}}}}}
  pairs: {{tip: {{slave: {{body: block, on: top}}, master: {{obstacle: tip}}}}}}
"""
IN_FLOW = f"""\
fluid:
  density: 1
  viscosity: 0.01
  scheme: backward_euler
  element: q2q1
  grid: {{from: [-1.2, 0], to: [1.2, 1.5], cells: [24, 16]}}
  patches:
    walls: {{on: [x-, x+, y-], no_slip: true}}
    top: {{on: y+, outflow: true}}
  bodies: {{tip: {{{DISC}, motion: {{displacement: {WAY}}}}}}}
coupling: {{scheme: monolithic}}
contact:
  pairs: {{tip: {{slave: {{body: block, on: top}}, master: {{obstacle: tip}}}}}}
"""


def run(folder, text, **settings):
    folder.mkdir()
    (folder / "case.yaml").write_text(SOLID.format(**settings) + text)
    assert run_case(load_case(folder / "case.yaml"), folder / "run") == FINISHED
    return read_history(folder / "run" / "history.csv")


@pytest.mark.slow
def test_the_block_carries_what_it_does_without_the_fluid(tmp_path):
    """Wedges of fluid beside the contact came and went with the iterates, and the disc could not be drawn back."""
    alone = run(tmp_path / "alone", ALONE, step=0.1, end=2, dynamics="")
    flow = run(tmp_path / "flow", IN_FLOW, step=0.05, end=4, dynamics="dynamics: {rho_inf: 0.5}")
    deepest = abs(flow["time"] - 2.0).argmin()
    assert flow["clamp.y"][deepest] == pytest.approx(alone["clamp.y"][-1], rel=0.005)
    assert flow["contact.active"][-1] == 0
    assert abs(flow["clamp.y"][-1]) < 0.005 * flow["clamp.y"][deepest]
