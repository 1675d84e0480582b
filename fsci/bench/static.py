"""A static load step of a three-dimensional body as the program computes it."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from fsci.bench.program import run_case
from fsci.bench.table import Row

CASE = """
time: {step: 1.0, end: 1.0}
structure:
  bodies:
    cube:
      mesh: {shape: box, size: [1, 1, 1], cells: [25, 25, 25]}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: [{on: left, displacement: [0, 0, 0]}]
      tractions: [{on: right, value: [0, 0, -50]}]
"""


def run() -> list[Row]:
    """Wall time [s] by part, Newton iterations and peak memory, for both linear solvers."""
    with TemporaryDirectory() as folder:
        case = Path(folder) / "case.yaml"
        case.write_text(CASE)
        # compiles the forms, which is not what is measured
        run_case(case, Path(folder) / "out", {"structure.bodies.cube.mesh.cells": [2, 2, 2]})
        return [measure(case, method) for method in ("direct", "iterative")]


def measure(case: Path, method: str) -> Row:
    summary = run_case(case, case.parent / "out", {"solver.linear.method": method})
    wall = summary["wall"]
    return {
        "method": method,
        "dofs": summary["dofs"]["structure"],
        "newton": summary["newton"]["total"],
        "total [s]": wall["total"],
        "start": wall["start"],
        "assembly": wall["assembly"],
        "solve": wall["solve"],
        "output": wall["output"] + wall["checkpoint"],
        "memory [MB]": round(summary["memory_mb"]),
    }
