"""Slaves and masters among facets that may touch each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.connected import connected_parts

SLAVE, MASTER = 1, 2

Roles = NDArray[np.int8]


def choose_roles(roles: Roles, pressed: NDArray[np.int64], pairs: NDArray[np.int64]) -> Roles:
    """Roles (SLAVE, MASTER or 0) of facets with undirected pairs (p, 2); those that are not 0 stay.

    In each connected part of the graph of pairs neighbours get different roles. In the graph with two copies of every
    facet, where a pair joins the one copy of one with the other copy of the other, such a part falls into two halves,
    which are the two ways to do it. The way with more pressed facets among the slaves is taken, else the one in which
    the first facet is a slave. A part with an odd circle has no such way: all its facets are slaves.
    Source: Yang & Laursen, Comput. Mech. 41 (2008), section 4, for the alternation.
    """
    k = len(roles)
    i, j = pairs.T
    part = connected_parts(np.concatenate([i, i + k]), np.concatenate([j + k, j]), 2 * k)
    first, second = part[:k], part[k:]
    low = np.minimum(first, second)
    # pressed facets speak for themselves as slaves, roles that are fixed count for more than all of them
    vote = pressed + (1.0 + pressed.sum()) * ((roles == SLAVE).astype(float) - (roles == MASTER))
    balance = np.bincount(low, np.where(first == low, vote, -vote), minlength=2 * k)
    slave = (first == second) | ((first == low) == (balance[low] >= 0.0))
    found = np.where(slave, SLAVE, MASTER).astype(np.int8)
    among = np.zeros(k, dtype=bool)
    among[pairs.ravel()] = True
    return np.where((roles == 0) & among, found, roles).astype(np.int8)
