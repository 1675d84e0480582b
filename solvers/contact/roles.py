"""The choice of slaves and masters among the facets of self contact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.connected import connected_parts

SLAVE, MASTER = 1, 2

Roles = NDArray[np.int8]


def choose_roles(roles: Roles, pressed: NDArray[np.int64], pairs: NDArray[np.int64]) -> Roles:
    """Roles (SLAVE, MASTER or 0) of facets with undirected pairs (p, 2); roles that are not 0 are kept.

    Neighbours in the graph of pairs get different roles: a two-colouring of each connected part. Take a graph with two
    copies of every facet, in which a pair joins different copies. There a part that can be coloured has two connected
    components, which are its two colourings. The colouring with more pressed facets among the slaves is chosen, else
    the one in which the first facet is a slave. In a part with an odd cycle all facets are slaves.
    Source: Yang & Laursen, Comput. Mech. 41 (2008), section 4, for the alternation.
    """
    k = len(roles)
    i, j = pairs.T
    part = connected_parts(np.concatenate([i, i + k]), np.concatenate([j + k, j]), 2 * k)
    first, second = part[:k], part[k:]
    low = np.minimum(first, second)
    # pressed facets vote for themselves as slaves; a fixed role outweighs all votes
    vote = pressed + (1.0 + pressed.sum()) * ((roles == SLAVE).astype(float) - (roles == MASTER))
    balance = np.bincount(low, np.where(first == low, vote, -vote), minlength=2 * k)
    slave = (first == second) | ((first == low) == (balance[low] >= 0.0))
    found = np.where(slave, SLAVE, MASTER).astype(np.int8)
    among = np.zeros(k, dtype=bool)
    among[pairs.ravel()] = True
    return np.where((roles == 0) & among, found, roles).astype(np.int8)
