"""Mutated case files: settings of small valid cases enlarged, replaced, deleted, copied elsewhere."""

from __future__ import annotations

import contextlib
import copy
import io
import random
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from fsci.stress.program import Ended, run_text

BEAM = """\
time: {step: 0.1, end: 0.1}
structure:
  dynamics: {rho_inf: 0.9}
  bodies:
    beam:
      mesh: {shape: rectangle, size: [2, 0.5], cells: [4, 1], order: 1, translate: [0, 0]}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, "0.01*t"]}]
      gravity: [0, -3]
      pressures: [{on: top, value: "t"}]
      tractions: [{on: right, value: [0, 0.1]}]
      initial_velocity: [0, "x"]
probes:
  tip: {quantity: displacement, at: [2, 0.25]}
  energy: {quantity: energy}
output: {fields_every: 1}
solver: {newton: {residual: 1e-8, max_iterations: 10}, linear: {method: auto}}
"""

PRESS = """\
time: {step: 0.5, end: 0.5, retry: {halvings: 1}}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 0.5], cells: [3, 2], origin: [0, 0.001]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      supports: [{on: top, displacement: [0, "-0.02*t"]}]
    base:
      mesh: {shape: rectangle, size: [2, 0.5], cells: [4, 2], origin: [-0.5, -0.5]}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.3, density: 1}
      supports: [{on: bottom, displacement: [0, 0]}]
contact:
  obstacles:
    floor: {mesh: {shape: rectangle, size: [3, 0.2], cells: [3, 1], origin: [-1, -0.7]}, on: top}
  pairs:
    p: {slave: {body: block, on: bottom}, master: {body: base, on: top}, friction: {coefficient: 0.2}}
    q: {slave: {body: base, on: bottom}, master: {obstacle: floor}}
probes:
  gap: {quantity: gap, pair: p}
"""

FLOW = """\
time: {step: 0.1, end: 0.1, retry: {halvings: 1}}
fluid:
  density: 1
  viscosity: 0.1
  scheme: bdf2
  flow: navier_stokes
  element: q1q1
  grid: {from: [0, 0], to: [2, 1], cells: [8, 5]}
  gravity: [0, -1]
  patches:
    inlet: {on: x-, velocity: ["y*(1 - y)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, cells: [8, 1], translate: [0.7, 0.5]}
      motion: {displacement: [0, "0.1*t"]}
probes:
  force: {quantity: force, body: disc}
  dp: {quantity: pressure, at: [0.1, 0.5], minus: [1.9, 0.5]}
  out: {field: fluid, quantity: flow_rate, through: outlet}
"""

POST = """\
time: {step: 0.02, end: 0.02, retry: {halvings: 1}}
fluid:
  density: 1
  viscosity: 0.05
  grid: {from: [0, 0], to: [2, 1], cells: [10, 5]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    post:
      mesh: {shape: rectangle, size: [0.23, 0.41], origin: [0.62, 0], cells: [2, 3]}
      material: {law: st_venant_kirchhoff, E: 1000, nu: 0.3, density: 10}
      supports: [{on: bottom, displacement: [0, 0]}]
contact:
  obstacles:
    wall: {mesh: {shape: rectangle, size: [0.1, 1], cells: [1, 1], origin: [0.86, 0]}, on: left}
  pairs:
    p: {slave: {body: post, on: right}, master: {obstacle: wall}}
coupling: {scheme: monolithic}
probes:
  tip: {quantity: displacement, at: [0.735, 0.41]}
  force: {quantity: force}
"""

CASES = (BEAM, PRESS, FLOW, POST)

#: other values, most of which a case may have
VALUES: list[Any] = [
    0, 1, -1, 2, 3, 0.5, -0.3, 1e-3, 1e3, 1e-12, 1e9, 1e-300, 1e300, None, True, False, "t", "x", "1/t", "sqrt(-1)",
    "where(x > 0.5, 1, 0)", "log(x)", [0, 0], [1, 0, 0], [0.5, 0.5], ["t", "-t"], [1], [], {}, "left", "right", "top",
    "x-", "y+", "beam", "post", "disc", "tri", "quad", "iterative", "direct", "bdf2", "backward_euler", "steady",
    "stokes", "q2q1", "partitioned", "monolithic", "mooney_rivlin", "neo_hooke", "coup_neo_hooke", "mixed", "stress",
]  # fmt: skip
#: of numbers
FACTORS = (-1, 0, 2, 3, 5, 0.5, 0.3, 0.1, 0.01, 10, 100, 1e4, 1e-6)
#: Cells in one direction above which a case takes too long.
MOST_CELLS = 40


def settings_of(data, found=None):
    """All settings in the data, as pairs (container, key)."""
    found = [] if found is None else found
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        found.append((data, key))
        if isinstance(value, dict | list):
            settings_of(value, found)
    return found


def mutate(data, chance: random.Random) -> None:
    """Change one setting: mostly the size of a number, else replace, delete or copy it."""
    kind, everything = chance.random(), settings_of(data)
    numbers = [(where, key) for where, key in everything if type(where[key]) in (int, float)]
    container, key = chance.choice(numbers if kind < 0.7 and numbers else everything)
    if kind < 0.7 and numbers:
        value = container[key]
        container[key] = type(value)(value * chance.choice(FACTORS)) + chance.choice([0, 0, 0, type(value)(1)])
    elif kind < 0.8:
        container[key] = chance.choice(VALUES)
    elif kind < 0.9:
        del container[key]
    else:
        other, name = chance.choice(settings_of(data))
        container[key] = copy.deepcopy(other[name])


def mutant(seed: int) -> str | None:
    """The text of a case, or None if it is too large to be computed for this."""
    chance = random.Random(seed)
    data = YAML(typ="safe", pure=True).load(chance.choice(CASES))
    for _ in range(chance.choice([1, 1, 1, 2, 3])):
        mutate(data, chance)
    for container, key in settings_of(data):
        cells = container[key] if key == "cells" else ()
        if any(isinstance(n, int | float) and n > MOST_CELLS for n in (cells if isinstance(cells, list) else [cells])):
            return None
    stream = io.StringIO()
    try:
        YAML(typ="safe", pure=True).dump(data, stream)
    except ValueError:
        return None
    return stream.getvalue()


def run_mutant(seed: int, folder: Path) -> Ended:
    """Compute the first mutant from this number on that is small enough, for one step."""
    from fsci.case import CaseError, load_case

    chance = random.Random(seed)
    text = None
    while text is None:
        text = mutant(chance.randrange(10**9))
    settings: list[str] = []
    (folder / "case.yaml").write_text(text)
    with contextlib.suppress(CaseError):  # the run says it too
        case = load_case(folder)
        if (case.time.end - case.time.start) / case.time.step > 2:
            settings = ["--set", f"time.end={case.time.start + case.time.step!r}"]
    return run_text(folder, text, *settings)
