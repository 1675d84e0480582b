"""Conversion of cells with 8 and 20 nodes to cells with 9 and 27: middle nodes are added, the geometry is unchanged.

Quadrilaterals of 8 nodes have -1/4 of the corners and 1/2 of the mid nodes in the middle, hexahedra of 20 nodes -1/4
and 1/4, their serendipity functions there. Displacements are full quadratic then: more accurate, not the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.mesh.cell_types import CELL_TYPES

Indices = NDArray[np.int64]

COMPLETE = {"quad8": "quad9", "hexahedron20": "hexahedron27"}


def missing(cell_type: str) -> list[tuple[list[int], NDArray[np.float64]]]:
    """(nodes, their weights) of each node that the full cell has besides, in its order."""
    nodes, given = CELL_TYPES[COMPLETE[cell_type]].nodes, int(cell_type.removeprefix("quad").removeprefix("hexahedron"))
    place = {frozenset(group): index for index, group in enumerate(nodes[:given])}
    found = []
    for corners in nodes[given:]:
        edges = [index for group, index in place.items() if len(group) == 2 and group <= set(corners)]
        weights = [-0.25] * len(corners) + [(1.0 + 0.25 * len(corners)) / len(edges)] * len(edges)
        found.append(([*corners, *edges], np.array(weights)))
    return found


def complete(
    points: NDArray[np.float64], blocks: list[tuple[str, Indices]]
) -> tuple[NDArray[np.float64], list[tuple[str, Indices]]]:
    """Points and blocks (cell type, nodes) of cells, with the new nodes after the old ones; neighbours share them."""
    numbers: dict[tuple[int, ...], int] = {}
    added: list[NDArray[np.float64]] = []
    done = []
    for cell_type, cells in blocks:
        columns = [cells]
        for local, weights in missing(cell_type) if cell_type in COMPLETE else []:
            column = np.empty(len(cells), dtype=np.int64)
            for row, nodes in enumerate(cells[:, local]):
                key = tuple(sorted(nodes.tolist()))
                if key not in numbers:
                    numbers[key] = len(points) + len(added)
                    added.append(weights @ points[nodes])
                column[row] = numbers[key]
            columns.append(column[:, None])
        done.append((COMPLETE.get(cell_type, cell_type), np.concatenate(columns, axis=1)))
    return np.concatenate([points, np.array(added).reshape(-1, points.shape[1])]), done
