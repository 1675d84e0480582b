"""The same numbers on every version of DOLFINx, PETSc, MPI and numpy, on one process and two.

NUMBERS were computed with DOLFINx 0.5.2, PETSc 3.18 and Open MPI 4.1. Newton's method goes on to rounding.
"""

import pytest
from case_text import with_section
from contact_cases import PLATE
from coupled_case import post
from programs import fsci

from fsci.running.history import read_history

TWISTED = """\
title: a block of second order is twisted and moves
time: {step: 0.02, end: 0.06}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    block:
      mesh: {shape: box, size: [2, 1, 1], cells: [2, 1, 1], order: 2}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      supports:
        - {on: left, displacement: [0, 0, 0]}
        - {on: right, displacement: ["t", "-3*t*z", "3*t*y"]}
probes:
  middle: {quantity: displacement, at: [1, 1, 1]}
  wall: {quantity: reaction, on: left}
  energy: {quantity: energy}
solver: {newton: {residual: 1.0e-12}}
"""

FRICTION = """\
  pairs:
    press: {slave: {body: block, on: top}, master: {obstacle: plate}, friction: {coefficient: 0.2}}
"""

#: A rigid plate presses and slides on a block, with friction.
PRESSED = with_section(with_section(PLATE, "time: {step: 0.125, end: 0.375}\n", "time"), FRICTION, "contact", "pairs")

FLOW = """\
title: a disc moves through a channel
time: {step: 0.02, end: 0.06}
fluid:
  density: 1.2
  viscosity: 0.02
  element: ELEMENT
  grid: {from: [0, 0], to: [2, 1], cells: [16, 8]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)*min(t/0.1, 1)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, cells: [40, 1], translate: [0.7, 0.52]}
      motion: {displacement: ["t", "0.1*sin(20*t)"]}
probes:
  force: {quantity: force}
  wake: {quantity: velocity, at: [1.3, 0.45]}
  drop: {quantity: pressure, at: [0, 0.5], minus: [2, 0.5]}
  outflow: {quantity: flow_rate, through: outlet}
solver: {newton: {residual: 1.0e-12}}
"""

SOLVER = "solver: {newton: {residual: 1.0e-11}}\n"

WALL = """\
coupling: {scheme: monolithic}
contact:
  obstacles:
    wall: {mesh: {shape: rectangle, size: [1, 1], cells: [1, 1], translate: [0.8501, 0]}, on: left}
  pairs: {stop: {slave: {body: post, on: right}, master: {obstacle: wall}}}
"""

CASES = {
    "twisted": TWISTED,
    "pressed": PRESSED,
    "flow q1q1": FLOW.replace("ELEMENT", "q1q1"),
    "flow q2q1": FLOW.replace("ELEMENT", "q2q1"),
    "post monolithic": post(0.06, rest=SOLVER),
    "post partitioned": post(0.06, "coupling: {scheme: partitioned, tolerance: 1.0e-10}\n", SOLVER),
    "stopped post": post(0.06, WALL, SOLVER),
}

#: case -> column of history.csv -> value at the end
NUMBERS: dict[str, dict[str, float]] = {
    "twisted": {
        "middle.x": 0.029153835817825678,
        "middle.y": -0.023755439118404,
        "middle.z": 0.010735762248726603,
        "wall.x": -18.028944848308406,
        "wall.y": -2.6175551448515115,
        "wall.z": 2.539960745929804,
        "energy.kinetic": 4.270569932156023,
        "energy.internal": 3.549125561926344,
        "energy.work": 7.538190255488949,
    },
    "pressed": {
        "foot.x": -4.822472449270793,
        "foot.y": -9.60551180333161,
        "foot.z": 102.09054262320979,
        "top.x": 0.016827258139784904,
        "top.y": 0.03510069252506348,
        "top.z": -0.09,
        "contact.active": 16.0,
        "contact.sticking": 10.0,
        "contact.friction": 0.3828880276799479,
    },
    "flow q1q1": {
        "force.x": 1.1281424512635558,
        "force.y": 10.043597727741759,
        "wake.x": 0.34437120170886254,
        "wake.y": -0.3263610894596194,
        "drop": 19.337871486628355,
        "outflow": 0.3937500000000023,
        "fluid.leak": 0.06971130072657131,
    },
    "flow q2q1": {
        "force.x": 1.8429273483869633,
        "force.y": 11.907816885667318,
        "wake.x": 0.34179126208672783,
        "wake.y": -0.2966894170946598,
        "drop": 20.556611836579517,
        "outflow": 0.40000000000000313,
        "fluid.leak": 0.012109584032648302,
    },
    "post monolithic": {
        "tip.x": 0.006694698944441016,
        "tip.y": -0.002635615847285825,
        "force.x": 3.602484061728801,
        "force.y": -2.572842127904341,
        "outflow": 0.39043501704371275,
        "fluid.leak": 0.020759716325230222,
    },
    "post partitioned": {
        "tip.x": 0.0066946989444728435,
        "tip.y": -0.0026356158472893316,
        "force.x": 3.6024840618562166,
        "force.y": -2.572842128062955,
        "outflow": 0.3904350170463696,
        "fluid.leak": 0.020759716325825323,
    },
    "stopped post": {
        "tip.x": 0.0022795404038017516,
        "tip.y": -0.0020567645743394453,
        "force.x": 5.049687790002437,
        "force.y": -2.747439968279549,
        "outflow": 0.3830336476937343,
        "contact.active": 5.0,
        "contact.stop.x": -4.383956046948628,
        "contact.stop.y": 2.800570793733744e-06,
        "fluid.leak": 0.03227349235928462,
    },
}

#: share of a probe's largest component (small components are sums that cancel)
TOLERANCE = 1e-9


@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", CASES)
def test_numbers_do_not_depend_on_the_version(name, processes, tmp_path):
    (tmp_path / "case.yaml").write_text(CASES[name])
    run = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "out", processes=processes, timeout=600)
    assert run.returncode == 0, run.stdout + run.stderr
    history = read_history(tmp_path / "out" / "history.csv")
    expected = NUMBERS[name]
    for column, value in expected.items():
        probe = column.rpartition(".")[0] or column
        size = max(abs(other) for key, other in expected.items() if key.startswith(probe))
        assert abs(history[column][-1] - value) <= TOLERANCE * size, column
