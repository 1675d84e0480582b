"""Benchmark of the mortar kernel: all integrals of a pair of facets that overlap."""

from __future__ import annotations

from time import process_time
from typing import Any

import numpy as np

from fsci import shapes
from fsci.bench.table import Row
from solvers.kernels import mortar, nodal_normals
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.search import Search
from solvers.mesh.topology import surface_facets


def measure(slave: tuple[str, int], master: tuple[str, int]) -> Row:
    """Microseconds of processor time for a pair, best of three; slave and master: cell and order of their bodies."""
    (xs, fs, type_s), (xm, fm, type_m) = _wavy_side(*slave, 12, "top"), _wavy_side(*master, 13, "bottom")
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
    return {"slave": type_s, "master": type_m, "pairs": overlapping, **times}


def _wavy_side(cell: str, order: int, cells: int, name: str) -> tuple[Any, Any, str]:
    """Positions, facets and kernel type of the top of a bent plate, or of the bottom of one just above it."""
    mesh = shapes.box((1, 1, 0.1), (cells, cells, 1), (0, 0, 0 if name == "top" else 0.101), order=order, cell=cell)
    x, y, z = mesh.points.T
    bent = np.ascontiguousarray(np.stack([x, y, z + 0.05 * np.sin(3 * x) * np.cos(2 * y)], axis=1))
    facets = np.ascontiguousarray(surface_facets(mesh, name), dtype=np.int64)
    return bent, facets, CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].kernel
