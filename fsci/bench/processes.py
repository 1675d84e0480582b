"""How a flow divides among processes: cells, cut cells, neighbours, exchanged bytes, iterations.

These counts are exact on a machine with fewer cores than processes, where time is not. Run as a program by mpirun, the
module writes the counts of one flow to standard output.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
from mpi4py import MPI

from fsci.bench import fluid
from fsci.bench.table import Row
from solvers.fluid.flow.field import Fluid
from solvers.timing import Timer


def row(processes: int, cells: int) -> Row:
    """A ring in a channel: the smallest and largest of all processes.

    work: largest of uncut + 3 cut cells over the mean.
    """
    command = ["mpirun", "-n", str(processes), sys.executable, "-m", "mpi4py", "-m", __name__, str(cells)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMPI_MCA_mpi_yield_when_idle": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    found = json.loads(done.stdout.splitlines()[-1])
    counts = {name: np.array(values) for name, values in found["by process"].items()}
    work = counts["uncut"] + 3 * counts["cut"]
    return {
        "processes": processes,
        "unknowns": found["unknowns"],
        "uncut cells": _range(counts["uncut"]),
        "cut cells": _range(counts["cut"]),
        "work": float(work.max() / work.mean()),
        "neighbours": _range(counts["neighbours"]),
        "halo [kB]": _range(counts["halo"] // 1000),
        "newton": found["newton"],
        "krylov": found["krylov"],
    }


def _range(values: np.ndarray) -> str:
    return f"{values.min()}-{values.max()}"


def measure(comm: MPI.Comm, cells: int) -> dict:
    """Counts of the first step, by process (collective)."""
    flow = fluid.ring_in_channel(cells, Timer(), comm)
    flow.initialise(0.0, 0.05)
    newton = flow.step(0.0, 0.05).iterations
    by_process = comm.allgather(_counts(flow))
    return {
        "unknowns": flow.dofs(),
        "newton": newton,
        "krylov": flow.iterate.linear_iterations,
        "by process": {name: [counts[name] for counts in by_process] for name in by_process[0]},
    }


def _counts(flow: Fluid) -> dict[str, int]:
    """Owned cells with fluid; processes that own unknowns of this one's ghosts; bytes received per exchange."""
    unknowns, owned = flow.unknowns, flow.grid.owned
    ends = np.cumsum(flow.comm.allgather(unknowns.owned))
    ghosts = unknowns.global_dofs[unknowns.owned :]
    return {
        "uncut": int((flow.cut.uncut < owned).sum()),
        "cut": int((flow.cut.cut < owned).sum()),
        "neighbours": len(np.unique(np.searchsorted(ends, ghosts, side="right"))),
        "halo": 8 * len(ghosts),
    }


if __name__ == "__main__":
    results = measure(MPI.COMM_WORLD, int(sys.argv[1]))
    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(results))
