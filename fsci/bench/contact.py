"""Benchmarks of contact: mortar kernel, search, and the whole run of two tori."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np

from fsci import shapes
from fsci.bench.program import run_case
from fsci.bench.search import measure_search
from fsci.bench.table import Row
from solvers.cell_types import CELL_TYPES
from solvers.kernels import mortar, nodal_normals
from solvers.mesh_topology import surface_facets
from solvers.search import Search

TORI = Path(__file__).parents[2] / "cases" / "two_tori"

#: Cell and order of the slave's body, of the master's
KERNEL_PAIRS = (
    (("tet", 1), ("tet", 1)),
    (("hex", 1), ("tet", 1)),
    (("hex", 1), ("hex", 1)),
    (("tet", 2), ("tet", 2)),
    (("hex", 2), ("hex", 2)),
)


def run_kernel() -> list[Row]:
    """Microseconds of processor time for a pair of facets that overlap, all integrals of it; best of three."""
    rows: list[Row] = []
    for (cell_s, order_s), (cell_m, order_m) in KERNEL_PAIRS:
        slave = _wavy_side(cell_s, order_s, 12, "top")
        master = _wavy_side(cell_m, order_m, 13, "bottom")
        rows.append({"slave": slave[2], "master": master[2], **measure_kernel(slave, master)})
    return rows


def _wavy_side(cell: str, order: int, cells: int, name: str) -> tuple[Any, Any, str]:
    """Positions, facets and kernel type of the top of a bent plate, or of the bottom of one just above it."""
    mesh = shapes.box((1, 1, 0.1), (cells, cells, 1), (0, 0, 0 if name == "top" else 0.101), order=order, cell=cell)
    x, y, z = mesh.points.T
    bent = np.ascontiguousarray(np.stack([x, y, z + 0.05 * np.sin(3 * x) * np.cos(2 * y)], axis=1))
    facets = np.ascontiguousarray(surface_facets(mesh, name), dtype=np.int64)
    return bent, facets, CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].kernel


def measure_kernel(slave: tuple[Any, Any, str], master: tuple[Any, Any, str]) -> Row:
    """Two surfaces, each as (positions, facets, kernel type)."""
    (xs, fs, type_s), (xm, fm, type_m) = slave, master
    normals, _ = nodal_normals(xs, fs, type_s)
    pairs = Search(fs, fm).pairs(xs, xm, 0.01)
    times, overlapping = {}, 0
    for name, derivatives in (("with derivatives [us]", True), ("values only [us]", False)):
        spent = []
        for _ in range(3):
            start = process_time()
            result = mortar(xs, fs, type_s, xm, fm, type_m, normals, pairs, np.ones_like(xs), derivatives=derivatives)
            spent.append(process_time() - start)
        overlapping = int(result.used.sum())
        times[name] = 1e6 * min(spent) / overlapping
    return {"pairs": overlapping, **times}


def run_search() -> list[Row]:
    """Microseconds per facet to build, refit and query the trees and to compare the boxes of the surfaces."""
    rows: list[Row] = []
    for facets in (1_000, 10_000, 100_000):
        found = measure_search(facets)
        count = int(found["facets"])
        times = {f"{part} [us]": 1e6 * found[part] / count for part in ("build", "refit", "query", "box")}
        rows.append({"facets": count, **times, "pairs": int(found["pairs"]), "tests": int(found["tests"])})
    return rows


def run_tori() -> list[Row]:
    """Seconds by part of all steps of `two_tori`; `contact` is everything but assembly and solution of the system."""
    with TemporaryDirectory() as folder:
        summary = run_case(TORI, Path(folder), {"output.fields_every": 0})
    steps, newton, wall = summary["steps"], summary["newton"], summary["wall"]
    parts = {name: wall[name] for name in ("assembly", "contact", "solve")}
    return [
        {
            "dofs": summary["dofs"]["structure"],
            "steps": steps["accepted"],
            "retried": steps["retried"],
            "newton": newton["total"],
            "most": newton["max"],
            "wall [s]": wall["total"],
            **{f"{name} [s]": seconds for name, seconds in parts.items()},
            "rest [s]": wall["total"] - sum(parts.values()),
        }
    ]
