"""Statics of bodies that only contact holds.

Without a node in contact their equilibrium has no solution, although they may be free just until they touch. So the
first iterate of a solve tries the node that is nearest. If it would pull, the next iterate opens it, and what is left
is singular as before: which nodes are tried does not change a solution.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array


def nearest_gaps(bodies: Sequence[Sequence[int]], of_pair: Array, mean_gap: Array, active: NDArray[np.bool_]) -> Array:
    """Mean gap [m] up to which multipliers are to be tried, zero of those of other bodies, shape (C,).

    bodies: numbers of the pairs of each; of_pair: area [m^(dim-1)] that each pair covers, shape (pairs, C); mean_gap:
    [m]; active: mask of the multipliers in contact, (C,).
    """
    found = np.zeros_like(mean_gap)
    for pairs in bodies:
        mine = (of_pair[list(pairs)] > 0.0).any(axis=0)
        if mine.any() and not active[mine].any():
            found[mine] = np.maximum(found[mine], mean_gap[mine].min())
    return found
