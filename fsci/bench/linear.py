"""Time of the direct and the iterative linear solver by size and shape of the body."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

from mpi4py import MPI

from fsci import shapes
from fsci.bench.table import Row
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Body, Support, Traction
from solvers.structure.field import Structure
from solvers.structure.materials import NeoHooke


def measure(size: Sequence[float], cells: Sequence[int], order: int = 1, cell: str = "hex") -> Row:
    """Seconds of one solve, the first with a matrix and a later one; iterations of the multigrid method.

    A box held at its left end and pulled aside at its right one.
    """
    mesh = shapes.box(size, cells, order=order, cell=cell)
    row: Row = {"dofs": mesh.points.size}
    for method in ("direct", "iterative"):
        held, pulled = Support("left"), Traction("right", (0.0, 0.0, -1.0))
        body = Body("body", mesh, NeoHooke(400.0, 600.0), supports=[held], tractions=[pulled], comm=MPI.COMM_SELF)
        structure = Structure([body], settings=SolverSettings(linear=method))  # type: ignore[arg-type]
        structure.initialise(0.0, 1.0)
        structure.begin_step(0.0, 1.0)
        structure.residual()
        for when in ("first", "later"):
            begin, assembly = perf_counter(), structure.timer.seconds.get("assembly", 0.0)
            structure.advance()
            seconds = perf_counter() - begin - (structure.timer.seconds["assembly"] - assembly)
            row[f"{method} {when} [s]"] = seconds
            structure.residual()
    row["iterations"] = structure.create_solver().getIterationNumber()
    return row
