"""The cost of a case before it is run, estimated from measured steps.

Each kind of problem has a few sizes, with the processor's time for a step and the memory of the run; in between, and
beyond, both go by powers of the number of unknowns. Contact and coupling are factors on that.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fsci.case import Case
from fsci.case.flow_element import flow_element
from fsci.check.check import structure_dofs
from fsci.meshes.nested import fluid_dofs
from solvers.mesh.mesh import Mesh

Point = tuple[float, float, float]  #: unknowns, seconds of a step, memory [MB]
Table = Mapping[str, Sequence[Point]]

#: Of another machine: `fsci bench cost -o` this file.
OWN_COSTS = Path.home() / ".cache" / "fsci" / "cost.json"


@dataclass(frozen=True)
class Cost:
    """On one process."""

    unknowns: int
    step: float  #: processor seconds of a time step
    memory: float  #: [MB]


def estimate(case: Case, structure: int | None, table: Table, dimension: int | None = None) -> Cost | None:
    """`structure`: unknowns of elastic bodies; None if a mesh is not known, and then so is the result.

    `dimension`: that of meshes, where the case does not tell.
    """
    dim = case.dimension or dimension
    parts: dict[str, int] = {}
    if case.structure is not None:
        if structure is None or dim is None:
            return None
        parts[f"structure {dim}D"] = structure
    if case.fluid is not None:
        parts[f"fluid {dim}D {flow_element(case).element}"] = fluid_dofs(case)
    if not parts:
        return None  # rigid bodies cost next to nothing
    seconds = {kind: _seconds(table[kind], dofs) for kind, dofs in parts.items()}
    if case.contact is not None and structure is not None:
        seconds[f"structure {dim}D"] *= _factor(table["contact"], table["structure 2D"], structure)
    step, unknowns = sum(seconds.values()), sum(parts.values())
    if case.coupling is not None:
        step *= _factor(table["coupled"], table["fluid 2D q1q1"], unknowns)
    program = min(memory for points in table.values() for _, _, memory in points)
    memory = program + sum(_memory(table[kind], dofs) - program for kind, dofs in parts.items())
    return Cost(unknowns, step, memory)


def in_words(case: Case, meshes: Mapping[str, Mesh]) -> str:
    """One line on the cost of a case; empty if its size is unknown."""
    cost = _cost(case, meshes)
    return "" if cost is None else describe_cost(cost, case.time.steps)


def _cost(case: Case, meshes: Mapping[str, Mesh]) -> Cost | None:
    structure = None if case.structure is None else structure_dofs(case, meshes)
    dimension = next((mesh.points.shape[1] for mesh in meshes.values()), None)
    return estimate(case, structure, costs(), dimension)


def too_much_memory(case: Case, meshes: Mapping[str, Mesh], machine: float) -> list[str]:
    """A warning if the run needs more memory than the machine has [MB]; with what the other element would need."""
    if (cost := _cost(case, meshes)) is None or cost.memory <= machine:
        return []
    advice = "take fewer cells"
    if case.fluid is not None and flow_element(case).element == "q2q1":
        fluid = case.fluid.model_copy(update={"element": "q1q1"})
        if (other := _cost(case.model_copy(update={"fluid": fluid}), meshes)) is not None:
            advice += f", or 'element: q1q1', which needs about {_memory_words(other.memory)}"
    return [
        f"the run needs about {_memory_words(cost.memory)}, and this machine has {_memory_words(machine)}: {advice}"
    ]


def memory_of_machine() -> float:
    """[MB]."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e6


def costs() -> Table:
    """Measured costs of this machine, or if there are none those of the machine of the developers."""
    try:
        rows = json.loads(OWN_COSTS.read_text())["results"]["cost"]
        own: dict[str, list[Point]] = {}
        for row in rows:
            own.setdefault(row["kind"], []).append((row["dofs"], row["step [s]"], row["memory [MB]"]))
    except (OSError, ValueError, KeyError, TypeError):
        return MEASURED
    return own if own.keys() >= MEASURED.keys() else MEASURED


def describe_cost(cost: Cost, steps: int) -> str:
    """Unknowns, time and memory in one line."""
    whole = f", {_time(cost.step * steps)} for all" if steps > 1 else ""
    return (
        f"about {cost.unknowns:,} unknowns, {_time(cost.step)} per step{whole}, {_memory_words(cost.memory)}, "
        "on one process (accurate to a factor of about three)"
    )


def _seconds(points: Sequence[Point], dofs: float) -> float:
    return _power([(n, seconds) for n, seconds, _ in points], dofs)


def _memory(points: Sequence[Point], dofs: float) -> float:
    return _power([(n, memory) for n, _, memory in points], dofs)


def _power(points: Sequence[tuple[float, float]], at: float) -> float:
    """Logarithmic interpolation; extrapolated above by the last interval, constant below."""
    if at <= points[0][0]:
        return points[0][1]
    last = next((i for i in range(1, len(points)) if at <= points[i][0]), len(points) - 1)
    (x0, y0), (x1, y1) = points[last - 1], points[last]
    slope = math.log(max(y1, 1e-9) / max(y0, 1e-9)) / math.log(x1 / x0)
    return y0 * (at / x0) ** slope


def _factor(points: Sequence[Point], plain: Sequence[Point], dofs: float) -> float:
    """Share of the time of a step at the nearest measured size."""
    at = min(max(dofs, points[0][0]), points[-1][0])
    return max(1.0, _seconds(points, at) / _seconds(plain, at))


def _time(seconds: float) -> str:
    if seconds < 1.0:
        return f"{1000 * seconds:.2g} ms" if seconds < 0.0995 else f"{seconds:.2g} s"
    for name, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {name}"
    return f"{seconds:.2g} s" if seconds < 9.95 else f"{seconds:.0f} s"


def _memory_words(megabytes: float) -> str:
    if megabytes < 995:
        return f"{round(megabytes, -1):.0f} MB"
    return f"{megabytes / 1000:.2g} GB" if megabytes < 9950 else f"{megabytes / 1000:,.0f} GB"


#: One process of a cloud machine, November 2026 (`fsci bench cost`)
MEASURED: Table = {
    "structure 2D": ((104, 0.0027, 145), (2210, 0.010, 147), (13_202, 0.040, 177)),
    "structure 3D": ((243, 0.0018, 148), (3675, 0.056, 170), (14_883, 0.51, 266)),
    "fluid 2D q1q1": ((975, 0.013, 155), (9963, 0.092, 183), (39_123, 0.33, 288)),
    "fluid 2D q2q1": ((2775, 0.036, 165), (16_653, 0.15, 220), (45_753, 0.59, 347)),
    "fluid 3D q1q1": ((2548, 0.14, 193), (16_900, 0.39, 244), (53_428, 1.3, 442)),
    "fluid 3D q2q1": ((4356, 0.81, 254), (13_312, 2.5, 447), (41_971, 8.3, 1510)),
    "coupled": ((1073, 0.028, 161), (10_845, 0.35, 215)),
    "contact": ((208, 0.0060, 149), (4420, 0.061, 166)),
}
