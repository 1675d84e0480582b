"""Which pieces of bodies contact joins at an iterate."""

from __future__ import annotations

import numpy as np

from solvers.algebra.connected import connected_parts
from solvers.api import Indices


def components_of(pieces: Indices, first: Indices, second: Indices) -> Indices:
    """The component of each node: a number that all nodes of pieces that touch share, -1 at rigid nodes, shape (N,).

    pieces: of each node, -1 where rigid, (N,); first, second: nodes that are opposite each other.
    """
    count = int(pieces.max(initial=0)) + 1
    if count == 1:
        return pieces
    ends = pieces[first], pieces[second]
    both = (ends[0] >= 0) & (ends[1] >= 0) & (ends[0] != ends[1])
    joined = np.unique(ends[0][both] * count + ends[1][both])
    found = connected_parts(joined // count, joined % count, count)
    return np.where(pieces >= 0, found[pieces], -1)
