"""The case fsi1, solved by a quasi-Newton scheme as other programs do: errors of the flag's tip, drag and lift."""

from __future__ import annotations

import json
from time import process_time

from mpi4py import MPI

from fsci.bench.families import grid_fsi1
from fsci.bench.family import CASES
from fsci.bench.table import Row
from fsci.builder.build import build
from fsci.case import load_case
from solvers.timing import Timer

#: Turek and Hron (2006), as the case's `verify` has them
REFERENCE = {"tip.x": 2.270493e-5, "tip.y": 8.208773e-4, "force.x": 14.29426, "force.y": 0.7637460}
NAMES = {"tip.x": "u_x", "tip.y": "u_y", "force.x": "drag", "force.y": "lift"}


def solve(scale: float) -> Row:
    """With so many times the cells of the case; seconds of the processor from the grid on."""
    coupling = {"scheme": "partitioned", "accelerator": "iqn"}
    settings = [("coupling", json.dumps(coupling)), *((name, str(n)) for name, n in grid_fsi1(scale).items())]
    case = load_case(CASES / "fsi1", settings)
    begin = process_time()
    simulation = build(case, MPI.COMM_WORLD, Timer())
    simulation.initialise(0.0, case.time.step)
    simulation.scheme.step(0.0, case.time.step)
    seconds = process_time() - begin
    found = simulation.probes()
    errors = {f"{NAMES[name]} error [%]": 100.0 * (found[name] / value - 1.0) for name, value in REFERENCE.items()}
    return {"dofs": sum(simulation.dofs.values()), "time [s]": seconds, **errors}
