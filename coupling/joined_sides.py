"""Both sides of a tie with the same vertices: then nothing lies between them, however the bodies are bent.

A tie holds in the mean over facets. Between its sides are slits and overlaps of the size of the bodies' errors, and a
cut that follows them would have fluid that comes and goes with each iterate of Newton's method.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from solvers.api import Array
from solvers.sparse import Sparse, diagonal, stack

#: Distance of two vertices that are one, relative to that to the next vertex of the same side. From 0.03 to 0.3 nothing
#: depends on it.
CLOSE = 0.3


def join_vertices(
    mixtures: Sequence[tuple[Sparse | None, int]], points: Sequence[Array], tied: Sequence[NDArray[np.int64]]
) -> list[Sparse]:
    """Mixtures of all surfaces from the nodes of all, with vertices of one for those of another in the same place.

    mixtures: of each surface from its own nodes (None: these are its vertices) and their count. points: vertices of
    each [m]. tied: numbers of its vertices on ties.
    """
    nodes = np.concatenate([[0], np.cumsum([count for _, count in mixtures])])
    rows = stack(
        [
            (diagonal(np.ones(count)) if mixture is None else mixture).with_columns(start + np.arange(count), nodes[-1])
            for (mixture, count), start in zip(mixtures, nodes, strict=False)
        ]
    )
    first = np.concatenate([[0], np.cumsum([len(x) for x in points])])
    source = np.arange(first[-1])
    for surface in range(1, len(points)):
        for earlier in range(surface):
            mine, other = _same_places(points[surface][tied[surface]], points[earlier][tied[earlier]])
            mine, other = first[surface] + tied[surface][mine], first[earlier] + tied[earlier][other]
            alone = source[mine] == mine
            source[mine[alone]] = source[other[alone]]
    return [rows[source[a:b]] for a, b in pairwise(first)]


def _same_places(x: Array, y: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers of points of two sides that are each other's nearest ones, and close to each other."""
    if not len(x) or not len(y):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    in_x, in_y = cKDTree(x), cKDTree(y)
    distance, to_y = in_y.query(x)
    _, to_x = in_x.query(y)
    free = np.minimum(in_x.query(x, k=[2])[0][:, 0], in_y.query(y, k=[2])[0][:, 0][to_y])
    mine = np.flatnonzero((to_x[to_y] == np.arange(len(x))) & (distance < CLOSE * free))
    return mine, to_y[mine]
