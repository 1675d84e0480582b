"""Cost of parts of the program that a case does not use: alternating time steps with and without the part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from mpi4py import MPI

from fsci.bench.small import BLOCK, DISC, FLOW, POST
from fsci.bench.table import Row
from fsci.builder.build import Simulation, build
from fsci.case import load_case
from fsci.run.watch import Watched
from solvers.api import Scheme
from solvers.timing import Timer

STEPS = 60
BEGIN = 5  #: steps that do not count: they compile and build trees

CUBE = """\
time: {step: 0.005, end: 1}
structure:
  dynamics: {rho_inf: 0.9}
  bodies:
    block:
      mesh: {shape: box, size: [1, 1, 1], cells: [8, 8, 8], origin: [0, 0, 50]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      gravity: [0, 0, -10]
contact:
  obstacles:
    floor: {mesh: {shape: box, size: [3, 3, 0.2], cells: [3, 3, 1], origin: [-1, -1, -0.2]}, on: top}
  pairs:
    floor: {slave: {body: block, on: bottom}, master: {obstacle: floor}}
"""

#: More than five cells wide: the flow around thinner ones has unknowns of each side, unless they may touch.
WIDE_POST = POST.replace("size: [0.23,", "size: [0.63,")

ROOF = """\
contact:
  obstacles:
    roof: {mesh: {shape: rectangle, size: [3, 0.2], cells: [3, 1], origin: [-1, 9]}, on: bottom}
  pairs:
    roof: {slave: {body: post, on: top}, master: {obstacle: roof}}
"""

OUTSIDE = """\
  bodies:
    disc: {mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [5, 5]}}
"""

MOVED = """\
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.78, 0.51]}
      motion: {displacement: ["0.1*sin(t)", 0]}
"""

#: name -> (scene, the part that it does not use)
SCENES = {
    "block, a pair that never meets": (BLOCK.replace("0.001", "50"), "contact"),
    "cube, a pair that never meets": (CUBE, "contact"),
    "post in a flow, a pair that never meets": (FLOW + WIDE_POST + ROOF, "contact"),
    "flow, a body outside of the box": (FLOW + OUTSIDE, "  bodies"),
}


#: name -> scene with sentinels
WATCHED = {
    "block, sentinels": BLOCK,
    "flow around a disc, sentinels": FLOW + DISC,
    "flow with a moved disc, sentinels": FLOW + MOVED,
    "post in a flow, sentinels": FLOW + POST,
}


def run() -> list[Row]:
    """Milliseconds of the processor per time step with and without the part, and their ratio."""
    rows = [measure(name, text, part) for name, (text, part) in SCENES.items()]
    return rows + [measure_sentinels(name, text) for name, text in WATCHED.items()]


def measure(name: str, text: str, part: str, steps: int = STEPS) -> Row:
    """The row of a scene with and without a part of its text."""
    return _measure(name, [_simulation(scene) for scene in (text, text.split(f"{part}:")[0])], steps)


def measure_sentinels(name: str, text: str, steps: int = STEPS) -> Row:
    """The row of a scene with and without sentinels; both compute the columns of the history."""
    return _measure(name, [_simulation(text, watched=watched) for watched in (True, False)], steps)


def _measure(name: str, both: Sequence[tuple[Simulation, Scheme, Timer, float]], steps: int) -> Row:
    """Medians over the steps, which the two scenes take by turns: others who use the machine disturb both.

    The last column is the largest difference of a part of the time, such as assembly, over the whole time.
    """
    spent, newton = np.zeros((2, steps)), np.zeros((2, steps))
    parts: dict[str, np.ndarray] = {}
    for number in range(steps):
        for which in (0, 1) if number % 2 else (1, 0):
            simulation, scheme, timer, dt = both[which]
            timer.seconds.clear()
            begin = process_time()
            newton[which, number] = scheme.step(number * dt, dt).iterations
            simulation.balances()
            spent[which, number] = process_time() - begin
            for kind, seconds in timer.seconds.items():
                parts.setdefault(kind, np.zeros((2, steps)))[which, number] = seconds
    per_newton = 1e3 * np.median((spent / newton)[:, BEGIN:], axis=1)
    by_part = {kind: 1e3 * np.median((s / newton)[:, BEGIN:], axis=1) for kind, s in parts.items()}
    largest = max(by_part, key=lambda kind: abs(by_part[kind][0] - by_part[kind][1]))
    return {
        "scene": name,
        "unknowns": sum(both[0][0].dofs.values()),
        "newton with": newton[0].mean(),
        "newton without": newton[1].mean(),
        "with [ms]": per_newton[0],
        "without [ms]": per_newton[1],
        "ratio": per_newton[0] / per_newton[1],
        "part that differs most": largest,
        "by [%]": 100.0 * (by_part[largest][0] - by_part[largest][1]) / per_newton[1],
    }


class ProcessorTimer(Timer):
    """Seconds of the processor, which others who use the machine do not change."""

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        begin = process_time()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + process_time() - begin


def _simulation(text: str, *, watched: bool = False) -> tuple[Simulation, Scheme, Timer, float]:
    timer = ProcessorTimer()
    with TemporaryDirectory() as folder:
        (Path(folder) / "case.yaml").write_text("title: a scene\n" + text)
        case = load_case(Path(folder), [])
        simulation = build(case, MPI.COMM_WORLD, timer)
    scheme = Watched(simulation.scheme, simulation.sentinels if watched else {}, timer)
    simulation.initialise(0.0, case.time.step)
    scheme.start(0.0)
    return simulation, scheme, timer, case.time.step
