"""Blocked multipliers: excluded because supports or other multipliers leave them no free direction, or their node is on
both sides of a pair."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.directions import free_normals
from solvers.contact.interface import ContactInterface
from solvers.contact.terms import find_normals


def find_blocked(interface: ContactInterface, x: Array) -> NDArray[np.bool_]:
    """Mask of the blocked multipliers for nodes at x [m], shape (C,). It is found once, at the start of a run."""
    multipliers, held = interface.multipliers, interface.nodes.held
    node, slaves = multipliers.node, multipliers.areas > 0.0
    if not held[node[slaves]].any() and multipliers.only_one.all():
        return interface.shared
    normals = find_normals(multipliers, x).values
    own = np.arange(len(node))  # treat every multiplier as the only one of its node
    is_free = np.abs(free_normals(normals, own, held[node])).max(axis=1) > 0.0
    whole = slaves & (interface.spans == "space")
    first = np.zeros(len(node), dtype=bool)
    first[np.flatnonzero(whole)[np.unique(node[whole], return_index=True)[1]]] = True
    blocked = slaves & (interface.nodes.fixed[node] | interface.shared | (~whole & ~is_free))
    return blocked | (slaves & np.isin(node, node[whole]) & ~first)
