"""A block between the floor and a lid dams up a fluid: what closed contact closes, no fluid passes and none presses."""

import pytest
from programs import fsci

from fsci.running.history import read_history

#: Height of the lid [m] over the floor, pressure [Pa] on one side, and length [m] of a cell along the lid.
HEIGHT, PRESSURE, CELL = 0.981, 1.0, 0.125
CASE = """\
time: {{step: 0.5, end: 3}}
fluid:
  density: 1
  viscosity: 0.1
  scheme: backward_euler
  grid: {{from: [{start}, 0], to: [{end}, 1.3], cells: [24, 11]}}
  patches:
    in: {{on: x-, pressure: "ramp(t, 0.5, 1)"}}
    out: {{on: x+, outflow: true}}
    walls: {{on: [y-, y+], no_slip: true}}
  bodies:
    lid:
      mesh: {{shape: rectangle, size: [5, 0.5], cells: [1, 1], origin: [-1, 1.001]}}
      motion: {{displacement: [0, "-0.02*ramp(t, 0, 0.5)"]}}
structure:
  dynamics: {{rho_inf: 0}}
  bodies:
    block:
      mesh: {{shape: rectangle, size: [1, 1], cells: [6, 6], origin: [1.013, 0], order: 1}}
      material: {{law: neo_hooke, E: 1e4, nu: 0.3, density: 1}}
      supports: [{{on: bottom, displacement: [0, 0]}}]
contact:
  friction: {{coefficient: 0.5}}
  pairs:
    top: {{slave: {{body: block, on: top}}, master: {{obstacle: lid}}}}
coupling: {{scheme: {scheme}}}
probes:
  force: {{quantity: force, body: block}}
  out: {{quantity: flow_rate, through: out}}
output: {{fields_every: 0}}
"""


@pytest.mark.parametrize(("scheme", "moved"), [("monolithic", 0.0), ("monolithic", CELL / 3.0), ("partitioned", 0.0)])
def test_nothing_passes_a_closed_contact(tmp_path, scheme, moved):
    """The lid and the block touch to rounding: cells between them without volume would join both sides of the block.

    The pressure acts on the side of the block alone; on its top it acted over half of it, with these cells, and up to
    the end of the cell of the edge without `closed_facets`.
    """
    text = CASE.format(scheme=scheme, start=-moved, end=3.0 - moved)
    (tmp_path / "case.yaml").write_text(text)
    done = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "have passed through" not in done.stdout
    found = read_history(tmp_path / "out" / "history.csv")
    assert abs(found["out"][-1]) < 1e-6
    assert abs(found["fluid.leak"][-1]) < 1e-6
    assert found["force.x"][-1] == pytest.approx(PRESSURE * HEIGHT, rel=1e-5)
    assert abs(found["force.y"][-1]) < 1e-6


def test_check_says_nothing_of_a_gap_that_contact_closes(tmp_path):
    """At the start there are 0.0085 cells between the lid and the block, and at the end none."""
    (tmp_path / "case.yaml").write_text(CASE.format(scheme="monolithic", start=0, end=3))
    checked = fsci("check", tmp_path)
    assert checked.returncode == 0
    assert "in the gap to" not in checked.stderr
