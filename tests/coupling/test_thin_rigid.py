"""Free rigid plates thinner than a cell: the flow moves them, and the fluid on each side has unknowns of its own."""

import numpy as np
import pytest
from test_coupled_run import run

#: a slanted plate of 0.2 cells in a uniform flow, with the velocity of the flow
CARRIED = """\
time: {step: 0.05, end: 0.5}
fluid:
  density: 1
  viscosity: 0.01
  element: ELEMENT
  grid: {from: [0, 0], to: [3, 2], cells: [30, 20]}
  initial_velocity: [1, 0]
  patches:
    inlet: {on: x-, velocity: [1, 0]}
    outlet: {on: x+, traction: [0, 0]}
    walls: {on: [y-, y+], slip: true}
  bodies:
    plate:
      mesh:
        {shape: rectangle, size: [0.02, 0.9], cells: [1, 9], origin: [-0.01, -0.45], rotate: {angle: 25},
         translate: [1.03, 1.04]}
      free: {density: 2, initial_velocity: [1, 0]}
coupling: {scheme: monolithic}
probes:
  end: {body: plate, quantity: displacement, at: [1.03, 1.04]}
  force: {quantity: force, body: plate}
  behind: {quantity: pressure, at: [0.7, 1.0]}
"""


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_plate_carried_by_a_uniform_flow(element, tmp_path):
    """It goes with the flow, by five cells, without force: nothing knows that it is there."""
    history = run(CARRIED.replace("ELEMENT", element), tmp_path)
    assert np.abs(history["end.x"] - history["time"]).max() < 1e-9
    assert np.abs(history["end.y"]).max() < 1e-9
    assert np.abs(history["force.x"]).max() < 1e-9
    assert np.abs(history["behind"]).max() < 1e-9
    assert np.abs(history["fluid.mass"]).max() < 1e-10


#: a plate of 0.2 cells that seals a channel without friction, pushed by the pressure at its inlet
PUSHED = """\
time: {step: 0.1, end: 2}
fluid:
  density: 1
  viscosity: 0.01
  element: ELEMENT
  grid: {from: [0, 0], to: [3, 1], cells: [30, 10]}
  patches:
    inlet: {on: x-, traction: [0.5, 0]}
    outlet: {on: x+, traction: [0, 0]}
    walls: {on: [y-, y+], slip: true}
  bodies:
    plate:
      mesh: {shape: rectangle, size: [0.02, 1.2], cells: [1, 12], origin: [1.037, -0.1]}
      free: {density: 50, held: [y, rotation]}
coupling: {scheme: monolithic}
probes:
  plate: {body: plate, quantity: velocity, at: [1.037, 0.5]}
  force: {quantity: force, body: plate}
  flow: {quantity: flow_rate, through: outlet}
solver: {newton: {residual: 1.0e-13}}
"""


@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow)])
def test_plate_that_is_pushed_along_a_channel(element, tmp_path):
    """Fluid of 2.98 kg and the plate of 1.2 kg have the acceleration 0.5 N / 4.18 kg; nothing passes the plate."""
    history = run(PUSHED.replace("ELEMENT", element), tmp_path)
    rate = 0.5 / (2.98 + 1.2)
    assert history["time"][-1] * history["plate.x"][-1] / 2 > 0.2  # it has moved by two cells
    assert np.abs(history["plate.x"] - rate * history["time"]).max() < 1e-12
    assert np.abs(history["flow"] - rate * history["time"]).max() < 1e-12
    assert np.abs(history["force.x"] - 1.2 * rate).max() < 1e-10
