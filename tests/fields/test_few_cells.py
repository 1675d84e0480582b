"""Bodies and grids with fewer cells than there are processes, and a process without any part of a surface."""

from pathlib import Path

import numpy as np
import pytest
from programs import fsci, on_processes

from fsci.running.history import read_history

ONE_CELL_ON_A_BLOCK = """\
time: {step: 1, end: 1}
structure:
  bodies:
    small:
      mesh: {shape: box, size: [1, 1, 1], cells: [1, 1, 1], order: 1, translate: [1, 1, 1]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: top, displacement: [0, 0, -0.02]}]
    big:
      mesh: {shape: box, size: [3, 3, 1], cells: [6, 6, 2], order: 1}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
contact:
  pairs: {p: {slave: {body: big, on: top}, master: {body: small, on: bottom}}}
probes:
  top: {body: small, quantity: reaction, on: top}
  middle: {body: small, quantity: displacement, at: [1.5, 1.5, 1.5]}
  volume: {quantity: volume}
"""

ONE_CELL_IN_MOTION = """\
time: {step: 0.05, end: 0.2}
structure:
  dynamics: {rho_inf: 0.9}
  bodies:
    one:
      mesh: {shape: box, size: [1, 1, 1], cells: [1, 1, 1], order: 1}
      material: {law: neo_hooke, E: "1000*(1 + x)", nu: 0.3, density: "1 + 0.1*x"}
      supports: [{on: [bottom, front], symmetry: true}, {on: left, displacement: [0, null, null]}]
      gravity: [0, 0, -1]
      pressures: [{on: top, value: 1}]
      tractions: [{on: right, value: [1, "0.5*t", 0]}]
      initial_velocity: [0, 0, "0.1*z"]
probes:
  corner: {quantity: displacement, at: [1, 1, 1]}
  inside: {quantity: velocity, at: [0.5, 0.3, 0.7]}
  support: {quantity: reaction, on: bottom}
  section: {quantity: traction, on: bottom}
  mean: {quantity: displacement, on: top}
  energy: {quantity: energy}
  moment: {quantity: angular_momentum}
"""

FLOW_OF_TWO_CELLS = """\
time: {step: 0.05, end: 0.1}
fluid:
  grid: {from: [0, 0], to: [2, 1], cells: [2, 1]}
  element: q2q1
  density: 1
  viscosity: 0.1
  body_force: [0.3, -1]
  patches:
    left: {on: x-, velocity: ["y*(1 - y)", 0]}
    right: {on: x+, outflow: true}
    walls: {on: [y-, y+], slip: true}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, cells: [16, 1], translate: [0.9, 0.5]}
      motion: {displacement: ["0.2*t", 0]}
probes:
  force: {quantity: force, body: disc}
  pressure: {quantity: pressure, at: [1.5, 0.5]}
  velocity: {quantity: velocity, at: [1.5, 0.5]}
  energy: {quantity: kinetic_energy}
"""

FLAP_OF_ONE_CELL = """\
time: {step: 0.01, end: 0.02}
fluid:
  density: 1
  viscosity: 1
  element: q1q1
  scheme: backward_euler
  grid: {from: [-1, 0], to: [1, 2], cells: [3, 3]}
  patches:
    walls: {on: [y-, y+], no_slip: true}
    inlet: {on: x-, velocity: [1, 0]}
    outlet: {on: x+, outflow: true}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    flap:
      mesh: {shape: rectangle, size: [0.7, 1], cells: [1, 1], order: 2, origin: [-0.35, 0]}
      material: {law: st_venant_kirchhoff, E: 4e3, nu: 0.3, density: 30}
      supports: [{on: bottom, displacement: [0, 0]}]
coupling: {scheme: monolithic}
probes:
  tip: {quantity: displacement, at: [0, 1]}
  force: {quantity: force}
"""

#: what is zero but for rounding, or a measure of time
NOT_COMPARED = ("wall", "residual", "fluid.mass", "interface.", "coupling.")


@pytest.mark.parametrize(
    ("case", "processes"),
    [
        (ONE_CELL_ON_A_BLOCK, 2),
        pytest.param(ONE_CELL_ON_A_BLOCK, 3, marks=pytest.mark.slow),
        pytest.param(ONE_CELL_IN_MOTION, 4, marks=pytest.mark.slow),
        pytest.param(FLOW_OF_TWO_CELLS, 4, marks=pytest.mark.slow),
        pytest.param(FLAP_OF_ONE_CELL, 4, marks=pytest.mark.slow),
    ],
    ids=["contact on 2", "contact", "motion", "flow", "coupled"],
)
def test_fewer_cells_than_processes(case, processes, tmp_path):
    (tmp_path / "case.yaml").write_text(case)
    found = []
    for count in (1, processes):
        run = fsci("run", tmp_path, "-o", tmp_path / str(count), processes=count)
        assert run.returncode == 0, run.stdout + run.stderr
        found.append(read_history(tmp_path / str(count) / "history.csv"))
    alone, together = found
    assert alone.keys() == together.keys()
    for name, values in alone.items():
        if not name.startswith(NOT_COMPARED):
            assert together[name] == pytest.approx(values, rel=1e-9, abs=1e-9 * np.abs(values).max() + 1e-12), name


def test_process_without_a_surface(tmp_path):
    program, found = Path(__file__).parents[1] / "setups" / "inner_cell.py", []
    for processes in (1, 2):
        out = tmp_path / f"{processes}.npz"
        on_processes(processes, program, out)
        found.append(np.load(out))
    for name, values in found[0].items():
        assert found[1][name] == pytest.approx(values, rel=1e-9, abs=1e-12), name
