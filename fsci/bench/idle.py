"""Cost of parts of the program that a case does not use: alternating time steps with and without the part."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import process_time

import numpy as np
from mpi4py import MPI

from fsci.bench.family import FamilyScene, Settings
from fsci.bench.table import Row
from fsci.builder.build import Simulation, build
from fsci.case import load_case
from fsci.running.watch import Watched
from solvers.api import Scheme
from solvers.timing import Timer

BEGIN = 5  #: steps that do not count: they compile and build trees


def measure(scene: FamilyScene, steps: int = 60) -> Row:
    """Milliseconds of the processor per Newton step with and without a part of the case, or its sentinels.

    Medians over the steps, which the two take by turns: others who use the machine disturb both. Runs with and without
    sentinels both compute the columns of the history. The last column is the largest difference of a part of the time,
    such as assembly, over the whole time.
    """
    steps, part = scene.given.get("steps", steps), scene.given["without"]
    if part == "sentinels":
        both = [_simulation(scene.folder, scene.settings, watched=watched) for watched in (True, False)]
    else:
        both = [_simulation(scene.folder, settings) for settings in (scene.settings, _without(scene, part))]
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


def _without(scene: FamilyScene, part: str) -> Settings:
    """Settings that take a part away."""
    others = {name: value for name, value in scene.settings.items() if not name.startswith(part)}
    return {**others, part: {} if "." in part else None}  # a section, or the bodies in one


def _simulation(
    folder: Path, settings: Settings, *, watched: bool = False
) -> tuple[Simulation, Scheme, ProcessorTimer, float]:
    timer = ProcessorTimer()
    case = load_case(folder, [(name, json.dumps(value)) for name, value in settings.items()])
    simulation = build(case, MPI.COMM_WORLD, timer)
    scheme = Watched(simulation.scheme, simulation.sentinels if watched else {}, timer, case.worded)
    simulation.initialise(0.0, case.time.step)
    scheme.start(0.0)
    return simulation, scheme, timer, case.time.step
