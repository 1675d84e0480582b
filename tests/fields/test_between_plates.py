"""A free disc or ball between two elastic plates: at rest each contact carries what is above it."""

from __future__ import annotations

import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: Sides that slide along z hold the upper plate upright.
BALL = """\
time: {step: 0.5, end: 7}
structure:
  dynamics: {rho_inf: 0}
  bodies:
    lower:
      mesh: {shape: box, size: [0.8, 0.8, 0.2], cells: [6, 6, 2]}
      material: {law: neo_hooke, E: 2.0e+5, nu: 0.3, density: 300}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
    upper:
      mesh: {shape: box, size: [0.6, 0.6, 0.1], cells: [5, 5, 1], order: 1, origin: [0.1, 0.1, 0.4991]}
      material: {law: neo_hooke, E: 2.0e+5, nu: 0.3, density: 300}
      gravity: [0, 0, -10]
      supports: [{on: [left, right], displacement: [0, null, null]}, {on: [front, back], displacement: [null, 0, null]}]
rigid:
  gravity: [0, 0, -10]
  dynamics: {rho_inf: 0}
  bodies:
    body:
      mesh: {shape: sphere, radius: 0.15, cells: [4, 1], translate: [0.4, 0.4, 0.3495]}
      density: 500
      held: [x, y, rotation]
contact: {bodies: all}
solver: {newton: {residual: 1.0e-11}}
probes: {mass: {body: body, quantity: mass}}
output: {fields_every: 0}
"""
DISC = (
    BALL.replace(
        "shape: box, size: [0.8, 0.8, 0.2], cells: [6, 6, 2]", "shape: rectangle, size: [0.8, 0.2], cells: [12, 3]"
    )
    .replace(
        "box, size: [0.6, 0.6, 0.1], cells: [5, 5, 1], order: 1, origin: [0.1, 0.1,",
        "rectangle, size: [0.6, 0.1], cells: [9, 2], origin: [0.1,",
    )
    .replace("displacement: [0, 0, 0]", "displacement: [0, 0]")
    .replace("[0, null, null]}, {on: [front, back], displacement: [null, 0, null]}", "[0, null]}")
    .replace("[0, 0, -10]", "[0, -10]")
    .replace(
        "sphere, radius: 0.15, cells: [4, 1], translate: [0.4, 0.4,",
        "disc, radius: 0.15, cells: [24, 1], translate: [0.4,",
    )
    .replace("[x, y, rotation]", "[x, rotation]")
)


def run(folder, text):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


def carried(found, plate, up):
    """Force of contact [N] on a plate at the end, of all pairs that its surfaces have with the body."""
    columns = [name for name in found if name.startswith(f"contact.{plate}_") and name.endswith(f"_body.{up}")]
    return sum(found[name][-1] for name in columns)


@pytest.mark.parametrize(
    ("text", "up", "volume"),
    [pytest.param(DISC, "y", 0.06, id="disc"), pytest.param(BALL, "z", 0.036, id="ball", marks=pytest.mark.slow)],
)
def test_contact_carries_the_weights_above_it(tmp_path, text, up, volume):
    found = run(tmp_path, text)
    plate, body = 3000.0 * volume, 10.0 * found["mass"][-1]
    assert carried(found, "upper", up) == pytest.approx(plate, rel=1e-6)
    assert carried(found, "lower", up) == pytest.approx(-plate - body, rel=1e-6)
