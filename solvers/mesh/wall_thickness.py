"""Thickness of the walls of a body by the facets of its surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.mesh.search import OPPOSED

#: Facets whose distances from all others are computed together, to bound the memory.
FACETS_AT_ONCE = 256


def wall_thickness(middles: Array, normals: Array, which: NDArray[np.int64] | None = None) -> Array:
    """Distance [m] of facets from the nearest opposed facet behind them, infinite if there is none, shape (k,).

    middles [m] and normals of all facets, (m, dim); which: those whose walls are measured, (k,), by default all.
    """
    chosen = np.arange(len(middles)) if which is None else which
    found = np.full(len(chosen), np.inf)
    for start in range(0, len(chosen), FACETS_AT_ONCE):
        some = slice(start, start + FACETS_AT_ONCE)
        part = chosen[some]
        away = middles[None] - middles[part, None]
        depth = -np.einsum("ijd,id->ij", away, normals[part])
        behind = (depth > 0.0) & (np.einsum("ijd,jd->ij", away, normals) > 0.0)
        behind &= normals[part] @ normals.T < OPPOSED
        distance = np.where(behind, np.linalg.norm(away, axis=2), np.inf)
        nearest = distance.argmin(axis=1)
        rows = np.arange(len(nearest))
        found[some] = np.where(np.isfinite(distance[rows, nearest]), depth[rows, nearest], np.inf)
    return found
