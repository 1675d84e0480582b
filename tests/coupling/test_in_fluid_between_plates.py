"""A free disc between two elastic plates in a fluid: at rest contact carries the weights above it less the fluid."""

from __future__ import annotations

import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: Sides that slide along y hold the upper plate upright.
SCENE = """\
time: {step: 0.05, end: 3.2}
fluid:
  density: 1
  viscosity: 0.5
  element: q1q1
  scheme: backward_euler
  gravity: [0, -10]
  grid: {from: [0, 0], to: [1, 1], cells: [12, 12]}
  patches: {top: {on: y+, traction: [0, 0]}, walls: {on: [x-, x+, y-], no_slip: true}}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.5, 0.3495]}
      free: {density: 20, held: [x, rotation]}
  dynamics: {rho_inf: 0}
structure:
  dynamics: {rho_inf: 0}
  bodies:
    lower:
      mesh: {shape: rectangle, size: [0.8, 0.2], origin: [0.1, 0], cells: [12, 3]}
      material: {law: neo_hooke, E: 3000, nu: 0.3, density: 2}
      supports: [{on: bottom, displacement: [0, 0]}]
    upper:
      mesh: {shape: rectangle, size: [0.6, 0.1], origin: [0.2, 0.4991], cells: [9, 2], order: 1}
      material: {law: neo_hooke, E: 3000, nu: 0.3, density: 20}
      gravity: [0, -10]
      supports: [{on: [left, right], displacement: [0, null]}]
contact: {bodies: all}
coupling: {scheme: monolithic}
probes:
  mass: {body: disc, quantity: mass}
  on_disc: {field: fluid, body: disc, quantity: force}
  on_upper: {field: fluid, body: upper, quantity: force}
output: {fields_every: 0}
"""
UPPER = 200.0 * 0.06


def carried(found, plate):
    """Force of contact [N] on a plate at the end, of all pairs that its surfaces have with the disc."""
    columns = [name for name in found if name.startswith(f"contact.{plate}_") and name.endswith("_disc.y")]
    return sum(found[name][-1] for name in columns)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "end"),  # with q2q1 the film below the disc closes for longer
    [
        pytest.param("", "", 3.2, id="monolithic"),
        pytest.param("order: 1", "order: auto", 4.0, id="second order"),  # bends more, and comes to rest later
        pytest.param("[0.5, 0.3495]", "[0.528, 0.3495]", 3.2, id="moved by a third of a cell"),
        pytest.param("element: q1q1", "element: q2q1", 9.0, id="q2q1"),
        pytest.param("{scheme: monolithic}", "{scheme: partitioned}", 3.2, id="partitioned"),
    ],
)
def test_contact_carries_the_weights_less_the_fluid(tmp_path, old, new, end):
    (tmp_path / "case.yaml").write_text(SCENE.replace(old, new).replace("end: 3.2", f"end: {end}"))
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") == FINISHED
    found = read_history(tmp_path / "out" / "history.csv")
    above = UPPER - found["on_upper.y"][-1]
    assert carried(found, "upper") == pytest.approx(above, rel=1e-6)
    disc = 10.0 * found["mass"][-1] - found["on_disc.y"][-1]
    assert carried(found, "lower") == pytest.approx(-above - disc, rel=1e-6)
    assert found["contact.on_disc.y"][-1] == pytest.approx(disc, rel=1e-6)
