"""Time of the direct and the iterative linear solver by size and shape of the body."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
from mpi4py import MPI

from fsci import shapes
from fsci.bench.table import Row
from solvers.mesh import Mesh
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Body, Support, Traction
from solvers.structure.field import Structure
from solvers.structure.materials import NeoHooke

#: name -> mesh: compact, slender, thin, with flat cells, of second order
MESHES: dict[str, Any] = {
    **{f"cube {n}^3 hex8": lambda n=n: shapes.box((1, 1, 1), (n, n, n)) for n in (9, 15, 20, 25)},
    **{f"beam {4 * n}x{n}x{n} hex8": lambda n=n: shapes.box((4, 1, 1), (4 * n, n, n)) for n in (6, 9, 12, 15)},
    "plate 60x60x3 hex8": lambda: shapes.box((4, 4, 0.2), (60, 60, 3)),
    "plate 40x40x10 hex8": lambda: shapes.box((4, 4, 0.2), (40, 40, 10)),
    **{f"cube {n}^3 hex27": lambda n=n: shapes.box((1, 1, 1), (n, n, n), order=2) for n in (5, 9, 12)},
    "cube 12^3 tet10": lambda: shapes.box((1, 1, 1), (12, 12, 12), order=2, cell="tet"),
}


def run() -> list[Row]:
    """Seconds of one solve, the first with a matrix and a later one; iterations of the multigrid method."""
    return [measure(name, build()) for name, build in MESHES.items()]


def measure(name: str, mesh: Mesh) -> Row:
    row: Row = {"body": name, "dofs": mesh.points.size}
    for method in ("direct", "iterative"):
        structure = clamped(mesh, method)
        structure.initialise(0.0, 1.0)
        structure.begin_step(0.0, 1.0)
        structure.residual()
        for when in ("first", "later"):
            begin, assembly = perf_counter(), structure.timer.seconds.get("assembly", 0.0)
            structure.advance()
            seconds = perf_counter() - begin - (structure.timer.seconds["assembly"] - assembly)
            row[f"{method} {when} [s]"] = seconds
            structure.residual()
    row["iterations"] = structure.linear_solver.getIterationNumber()
    return row


def clamped(mesh: Mesh, method: Any) -> Structure:
    """A body held at its left end and pulled aside at its right one."""
    held, pulled = Support("left"), Traction("right", (0.0, 0.0, -1.0))
    body = Body("body", mesh, NeoHooke(400.0, 600.0), supports=[held], tractions=[pulled], comm=MPI.COMM_SELF)
    return Structure([body], settings=SolverSettings(linear=method))


def constant(value: float):
    return lambda x, t: np.full(x.shape[1], value)
