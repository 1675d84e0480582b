"""The connected pieces of bodies: each moves by itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers import fem
from solvers.connected import connected_parts
from solvers.structure.body import Body


def pieces(bodies: Sequence[Body]) -> tuple[NDArray[np.int64], int]:
    """(number of the piece of each owned node, body by body, count of all pieces); cells connect nodes (collective)."""
    found, count = [], 0
    for body in bodies:
        names, every = _smallest_names(body)
        found.append(np.searchsorted(every, names) + count)
        count += len(every)
    return np.concatenate(found), count


def _smallest_names(body: Body) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(smallest node of the mesh file in the piece of each owned node, those of all pieces in order) (collective)."""
    comm, names = body.domain.comm, body.nodes
    ordered, rank = np.unique(names, return_inverse=True)
    cells = rank[fem.cell_blocks(body.space)]
    edges = np.repeat(cells[:, 0], cells.shape[1] - 1), cells[:, 1:].ravel()
    smallest = ordered[connected_parts(*edges, len(ordered))][rank]  # in the cells of this process
    # the parts of processes are connected by the nodes that they share
    shared = np.concatenate(comm.allgather(names[body.owned :]))
    at = np.isin(names, shared)
    known = np.concatenate(comm.allgather(np.column_stack([smallest, np.where(at, names, smallest)])))
    roots, numbers = np.unique(known, return_inverse=True)
    numbers = numbers.reshape(known.shape)
    root = roots[connected_parts(numbers[:, 0], numbers[:, 1], len(roots))]
    return root[np.searchsorted(roots, smallest[: body.owned])], np.unique(root)
