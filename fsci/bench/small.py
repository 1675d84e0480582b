"""Time steps of small problems: what is left of them is what Python and the libraries take, whatever the size."""

from __future__ import annotations

import resource
from pathlib import Path
from tempfile import TemporaryDirectory

from fsci.bench.program import run_case
from fsci.bench.table import Row

#: Steps of the shorter run; the longer one takes three times as many, and the difference counts.
STEPS = 40

BEAM = """\
time: {step: 0.05, end: 1}
structure:
  dynamics: {rho_inf: 0.9}
  bodies:
    beam:
      mesh: {shape: rectangle, size: [2, 0.5], cells: [22, 2]}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, 0]}]
      gravity: [0, "-3*sin(3*t)"]
"""

BLOCK = """\
time: {step: 0.005, end: 1}
structure:
  dynamics: {rho_inf: 0.9}
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 0.5], cells: [8, 4], origin: [0, 0.001]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      gravity: [0, -10]
contact:
  obstacles:
    floor: {mesh: {shape: rectangle, size: [3, 0.2], cells: [3, 1], origin: [-1, -0.2]}, on: top}
  pairs:
    floor: {slave: {body: block, on: bottom}, master: {obstacle: floor}}
"""

CHANNEL = """\
fluid:
  density: 1
  viscosity: 0.05
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)*min(t/0.1, 1)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
"""

FLOW = "time: {step: 0.02, end: 1}\n" + CHANNEL

DISC = """\
  bodies:
    disc: {mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.78, 0.51]}}
"""

COLUMN = """\
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    post:
      mesh: {shape: rectangle, size: [0.23, 0.41], origin: [0.62, 0], cells: [3, 5]}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.3, density: 10}
      supports: [{on: bottom, displacement: [0, 0]}]
"""

POST = COLUMN + "coupling: {scheme: monolithic}\n"

#: what -> (case, step [s])
CASES = {
    "beam": (BEAM, 0.05),
    "block on a floor": (BLOCK, 0.005),
    "flow past a disc": (FLOW + DISC, 0.02),
    "post in a flow": (FLOW + POST, 0.02),
}


def run() -> list[Row]:
    """Milliseconds of the processor per time step, fields written in each."""
    return [measure(name, text, step) for name, (text, step) in CASES.items()]


def measure(name: str, text: str, step: float, steps: int = STEPS) -> Row:
    with TemporaryDirectory() as folder:
        (Path(folder) / "case.yaml").write_text(text)
        spent, summaries = [], []
        for number in (steps, 3 * steps):
            before = _children()
            summaries.append(run_case(Path(folder), Path(folder) / f"{number}", {"time.end": number * step}))
            spent.append(_children() - before)
    newton = summaries[1]["newton"]["total"] / (3 * steps)
    return {
        "problem": name,
        "unknowns": sum(summaries[1]["dofs"].values()),
        "newton per step": newton,
        "step [ms]": 1e3 * (spent[1] - spent[0]) / (2 * steps),
    }


def _children() -> float:
    """Seconds of the processor that processes of this one have taken."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
