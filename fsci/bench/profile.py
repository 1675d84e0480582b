"""Time of a Newton iteration of a flow by part, in microseconds per unknown, against the memory bandwidth."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import wraps
from typing import Any
from unittest.mock import patch

import numpy as np
from mpi4py import MPI

from coupling import monolithic
from coupling.blocks import Blocks
from coupling.monolithic import Monolithic
from fsci.bench import fluid
from fsci.bench.family import CASES
from fsci.bench.table import Row
from fsci.builder.build import build
from fsci.case.load import load_case
from solvers import fem
from solvers.algebra import linear, unlocked
from solvers.fluid.cut.cut import Cutter
from solvers.fluid.cut.weights import Weights
from solvers.fluid.flow.field import Fluid
from solvers.fluid.solve import kept_tangent
from solvers.fluid.solve.linear_systems.multigrid import Multigrid
from solvers.fluid.solve.system import FlowSystem
from solvers.fluid.terms.interface import InterfaceTerms
from solvers.timing import Timer

#: Part -> functions that belong to it; what one calls that belongs to another part counts there alone.
PARTS: dict[str, list[tuple[Any, str]]] = {
    "cut": [(Cutter, "__call__")],
    "weights": [(Weights, "set"), (FlowSystem, "set_cut"), (FlowSystem, "_interface_penalties")],
    "interface": [
        (InterfaceTerms, "__init__"),
        (InterfaceTerms, "velocity_terms"),
        (InterfaceTerms, "force"),
        (Monolithic, "coupling_blocks"),
    ],
    "assembly": [(fem, "assemble_matrix"), (fem, "assemble_vector")],
    "matrix": [
        (FlowSystem, "tangent"),
        (FlowSystem, "_follow"),
        (kept_tangent, "rounding_error"),
        (monolithic, "rounding_error"),
        (Monolithic, "blocks"),
        (Fluid, "linearise"),
        *((Blocks, name) for name in ("transform", "hold", "product", "assembled")),
    ],
    "set-up": [(Multigrid, "preconditioner"), (Monolithic, "_krylov_solver")],
}


@dataclass
class Parts:
    """Seconds of the processor by part, each for itself."""

    seconds: dict[str, float] = field(default_factory=dict)
    iterations: int = 0
    set_ups: int = 0
    _open: list[str] = field(default_factory=list)  #: one inside the other, the innermost last
    _since: float = 0.0

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        self._count()
        self._open.append(name)
        try:
            yield
        finally:
            self._count()
            self._open.pop()

    def _count(self) -> None:
        now = time.process_time()
        if self._open:
            self.seconds[self._open[-1]] = self.seconds.get(self._open[-1], 0.0) + now - self._since
        self._since = now

    def counted(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, as a part of that name."""

        @wraps(function)
        def timed(*arguments: Any, **more: Any) -> Any:
            with self(name):
                return function(*arguments, **more)

        return timed

    def solve(self, ksp: Any, b: Any, x: Any) -> None:
        """`unlocked.solve` in its two parts."""
        before = self.seconds.get("set-up", 0.0)
        with self("set-up"):
            ksp.setUp()
        self.set_ups += self.seconds["set-up"] - before > 1e-3  # a kept one takes microseconds
        with self("Krylov"):
            _solve(ksp, b, x)
        self.iterations += int(ksp.getIterationNumber())


_solve = unlocked.solve


@contextmanager
def measured() -> Iterator[Parts]:
    """Count the parts of all flows meanwhile."""
    parts = Parts()
    with ExitStack() as stack:
        for name, functions in PARTS.items():
            for owner, attribute in functions:
                stack.enter_context(patch.object(owner, attribute, parts.counted(name, getattr(owner, attribute))))
        stack.enter_context(patch.object(linear.unlocked, "solve", parts.solve))
        stack.enter_context(parts("rest"))
        yield parts


def channel(cells: int, steps: int) -> list[Row]:
    """A ring in a channel."""
    flow = fluid.ring_in_channel(cells, Timer())
    flow.initialise(0.0, 0.05)

    def step(number: int) -> int:
        return flow.step(number * 0.05, 0.05).iterations

    return rows(f"channel {cells}^3", flow, step, steps)


def case(name: str, steps: int) -> list[Row]:
    """The first steps of a case, without output."""
    given = load_case(CASES / name)
    simulation = build(given, MPI.COMM_SELF, Timer())
    start, dt = given.time.start, given.time.step
    simulation.initialise(start, dt)
    scheme: Any = simulation.scheme

    def step(number: int) -> int:
        return scheme.step(start + number * dt, dt).iterations

    return rows(name, scheme.coupled.flow, step, steps)


def rows(what: str, flow: Fluid, step: Callable[[int], int], steps: int) -> list[Row]:
    """Rows of the time of steps after the first, and of the time to read and write the matrix by memory bandwidth."""
    step(0)
    with measured() as parts:
        newton = sum(step(number) for number in range(1, steps + 1))
    matrix = flow.system.matrix.values
    size, entries = flow.dofs(), matrix.getInfo()["nz_used"]
    passes = {
        "assembly": 2.0 * newton,  # read and written
        "matrix": 1.0 * newton,  # set to zero; the ghost penalty that is added has few rows
        "set-up": 2.0 * parts.set_ups,
        "Krylov": 2.0 * parts.iterations,  # the matrix and its incomplete factors
    }
    names = [*PARTS, "Krylov", "rest"]
    per_unknown = 1e6 / (size * newton)
    found = {name: per_unknown * parts.seconds.get(name, 0.0) for name in names}
    move = 8.0 * entries / bandwidth()
    least = {name: per_unknown * move * passes.get(name, 0.0) for name in names}
    both = []
    for label, values in ((what, found), ("  memory alone", least)):
        counts = {"unknowns": size, "newton": newton / steps, "krylov": parts.iterations / newton}
        both.append({"us per unknown": label, **counts, **values, "total": sum(values.values())})
    return both


def bandwidth(size: int = 32_000_000) -> float:
    """Bytes per second at which a large array is summed."""
    values, best = np.ones(size), np.inf
    for _ in range(5):
        begin = time.process_time()
        values.sum()
        best = min(best, time.process_time() - begin)
    return 8.0 * size / best
