"""Cases with contact that several tests use, and how they are run."""

from __future__ import annotations

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: A rigid plate comes down on a block, slides and leaves it, twice.
PLATE = """\
title: a plate on a block
time: {step: 0.125, end: 1.0}
structure:
  bodies:
    block:
      mesh: {shape: box, size: [1, 1, 1], cells: [3, 3, 3], order: 1}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1.0}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
contact:
  obstacles:
    plate:
      mesh: {shape: box, size: [3, 3, 1], cells: [1, 1, 1], order: 1, translate: [-1, -1, 1.01]}
      on: bottom
      motion: ["0.05*t", "0.1*t", "-0.2*sin(2*pi*t)^2"]
  pairs:
    press: {slave: {body: block, on: top}, master: {obstacle: plate}}
probes:
  foot: {quantity: reaction, on: bottom}
  top: {quantity: displacement, at: [0.4, 0.5, 1]}
  energy: {quantity: energy}
solver: {newton: {residual: 1.0e-12}}
"""


#: Two blocks that fly; the left one is faster. Their centres miss each other.
COLLISION = """\
title: two blocks collide
time: {step: 0.02, end: 1.0}
structure:
  dynamics: {rho_inf: 1.0}
  bodies:
    left:
      mesh: {shape: rectangle, size: [1, 1], cells: [3, 4], order: 1}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1.0}
      initial_velocity: [3, 0.5]
    right:
      mesh: {shape: rectangle, size: [1, 1], cells: [3, 3], order: 1, cell: tri, translate: [1.2, 0.3]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 2.0}
      initial_velocity: [-1, 0]
contact:
  pairs:
    meet: {slave: {body: left, on: right}, master: {body: right, on: left}}
probes:
  momentum: {quantity: momentum}
  right: {body: right, quantity: momentum}
  energy: {quantity: energy}
solver: {newton: {residual: 1.0e-12}}
"""


BEFORE = 0.5 * 1.0 * (3**2 + 0.5**2) + 0.5 * 2.0 * 1.0  #: energy of the two blocks before they meet


#: A block that slides between walls comes down on a plate by 0.1 per time; it is 0.035 above it.
PISTON = """\
title: a block between walls
time: {step: 0.1, end: 0.6}
structure:
  plane: strain
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [3, 2], order: 1}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.25}
      supports:
        - {on: [left, right], symmetry: true}
        - {on: top, displacement: [0, -0.1*t]}
contact:
  obstacles:
    plate: {mesh: {shape: rectangle, size: [3, 1], cells: [4, 1], translate: [-1, -1.035]}, on: top}
  pairs:
    press: {slave: {body: block, on: bottom}, master: {obstacle: plate}}
probes:
  pressure: {quantity: pressure, pair: press}
  least: {quantity: pressure, pair: press, extreme: least}
  corner: {quantity: pressure, pair: press, at: [1, 0]}
  gap: {quantity: gap, pair: press}
  wide: {quantity: gap, pair: press, extreme: largest}
  middle: {quantity: gap, pair: press, at: [0.3, 0.1]}
  touch: {quantity: first_contact, pair: press}
verify:
  - {value: touch, reference: 0.4, absolute: 1e-12}
solver: {newton: {residual: 1.0e-12}}
"""


def run(text, folder, *overrides):
    """Run a case in this process; its history."""
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml", list(overrides)), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")
