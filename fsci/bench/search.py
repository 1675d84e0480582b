"""Benchmark of the search for contact."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np

from fsci.bench.table import Row
from solvers.api import Array
from solvers.kernels import KdopTree3
from solvers.mesh.search import Facets


def measure(facets: int) -> Row:
    """Microseconds per facet to build, refit and query the trees and to compare the boxes of the surfaces."""
    found = measure_search(facets)
    count = int(found["facets"])
    times = {f"{part} [us]": 1e6 * found[part] / count for part in ("build", "refit", "query", "box")}
    return {"facets": count, **times, "pairs": int(found["pairs"]), "tests": int(found["tests"])}


def measure_search(facets: int) -> dict[str, float]:
    """Time of the search for two wavy sheets of about so many quads each, a tenth of an edge apart.

    Seconds for `build` and `refit` (one tree), `query` and `box` (both surfaces), best of three; numbers of
    `facets`, `pairs` and k-DOP `tests`.
    """
    cells = round(np.sqrt(facets))
    edge = 1 / cells
    (xs, slave_facets), (xm, master_facets) = wavy_sheet(cells), wavy_sheet(cells + 1, 0.1 * edge)
    slave, master = KdopTree3(slave_facets), KdopTree3(master_facets)
    radii = np.full(len(slave_facets), 0.3 * edge)
    master.build(xm, np.zeros(len(master_facets)))
    times = {
        "build": _seconds(lambda: slave.build(xs, radii)),
        "refit": _seconds(lambda: slave.refit(xs, radii)),
        "query": _seconds(lambda: slave.candidates(master)),
        "box": _seconds(lambda: (slave.box(xs), master.box(xm))),
    }
    pairs, tests = slave.candidates(master)
    return {"facets": len(slave_facets), **times, "pairs": len(pairs), "tests": tests}


def wavy_sheet(cells: int, height: float = 0.0) -> tuple[Array, Facets]:
    """Node positions and quads (cells x cells) of a sheet over the unit square."""
    s, t = np.meshgrid(*2 * [np.linspace(0, 1, cells + 1)], indexing="ij")
    points = np.stack([s, t, height + 0.1 * np.sin(7 * s) * np.cos(5 * t)], axis=-1).reshape(-1, 3)
    node = np.arange(len(points)).reshape(s.shape)
    corners = [node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]]
    return points, np.stack(corners, axis=-1).reshape(-1, 4)


def _seconds(call: Callable[[], object]) -> float:
    times = []
    for _ in range(3):
        start = perf_counter()
        call()
        times.append(perf_counter() - start)
    return min(times)
