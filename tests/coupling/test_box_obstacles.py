"""`contact: {bodies: all}` in a flow: closed faces of the box are obstacles."""

from __future__ import annotations

import numpy as np

from fsci.builder.automatic_pairs import with_pairs
from fsci.case import load_case
from fsci.run.history import read_history
from fsci.run.run import FINISHED, run_case

FALLING = """\
time: {step: 0.02, end: 0.42}
fluid:
  density: 1
  viscosity: 0.05
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 1.2], cells: [10, 12]}
  patches: {top: {on: y+, outflow: true}, walls: {on: [x-, x+, y-], slip: true}}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.533, 0.4]}
      material: {law: neo_hooke, E: 3000, nu: 0.3, density: 15}
      gravity: [0, -10]
coupling: {}
contact: {bodies: all}
probes: {centre: {field: structure, body: disc, quantity: centre}}
output: {fields_every: 0}
"""
FLOOR = """\
contact:
  obstacles: {floor: {mesh: {shape: rectangle, size: [3, 0.2], cells: [1, 1], origin: [-1, -0.2]}, on: top}}
  pairs: {floor: {slave: {body: disc, on: outer}, master: {obstacle: floor}}}
"""


def pairs(text, folder):
    (folder / "case.yaml").write_text(text)
    return {
        (pair.slave.body, pair.master.obstacle)
        for pair in with_pairs(load_case(folder / "case.yaml")).contact.pairs.values()
    }


def run(text, folder):
    folder.mkdir()
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


def test_the_floor_holds_an_elastic_disc(tmp_path):
    """As an obstacle does that the case puts there."""
    found = run(FALLING, tmp_path / "all")
    named = run(FALLING.replace("contact: {bodies: all}\n", FLOOR), tmp_path / "named")
    assert found["centre.y"].min() > 0.15
    np.testing.assert_allclose(found["centre.y"], named["centre.y"], rtol=1e-9)
    force = found["contact.disc_outer_walls_y_low.y"]
    assert force.max() > 10.0
    np.testing.assert_allclose(force, named["contact.floor.y"], rtol=1e-6, atol=1e-6)


def test_closed_faces_alone(tmp_path):
    """Not the outflow; not a face where an obstacle of the case lies, nor one that a body crosses at the start."""
    assert pairs(FALLING, tmp_path) == {("disc", f"walls_{face}") for face in ("x_low", "x_high", "y_low")}
    obstacle = FLOOR.split("  pairs")[0].replace("contact:\n", "contact:\n  bodies: all\n")
    own = pairs(FALLING.replace("contact: {bodies: all}\n", obstacle), tmp_path)
    assert own == {("disc", name) for name in ("walls_x_low", "walls_x_high", "floor")}
    assert ("disc", "walls_y_low") not in pairs(FALLING.replace("[0.533, 0.4]", "[0.533, 0.1]"), tmp_path)


BLOCK = """\
time: {step: 0.02, end: 0.3}
fluid:
  density: 1
  viscosity: 0.05
  grid: {from: [0, 0, 0], to: [1, 1, 1], cells: [4, 4, 4]}
  patches: {all: {on: [x-, x+, y-, y+, z-, z+], no_slip: true}}
structure:
  dynamics: {}
  bodies:
    block:
      mesh: {shape: box, size: [0.3, 0.3, 0.3], origin: [0.3, 0.3, 0.4], cells: [1, 1, 1]}
      material: {law: neo_hooke, E: 3000, nu: 0.3, density: 15}
coupling: {}
contact: {bodies: all}
"""


def test_faces_in_space(tmp_path):
    """A block in a closed box has six faces around it, each in front of one of its own."""
    (tmp_path / "case.yaml").write_text(BLOCK)
    found = with_pairs(load_case(tmp_path / "case.yaml")).contact.pairs.values()
    names = {"left": "x_low", "right": "x_high", "front": "y_low", "back": "y_high", "bottom": "z_low", "top": "z_high"}
    assert {(*pair.slave.on, pair.master.obstacle) for pair in found} == {(a, f"all_{b}") for a, b in names.items()}
