"""Slave and master surfaces of one body that have nodes in common, such as the lips of a notch.

A node that is on both sides has no gap: its multiplier has no constraint and is the mean of its neighbours'. Facets
with a common node are no pair, as in self contact.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices
from solvers.mesh.search import Search


class SearchApart:
    """A search that leaves out pairs of facets with a common node."""

    def __init__(self, search: Search, slave_nodes: Indices, master_nodes: Indices):
        """Nodes of the facets of both surfaces among all nodes, shapes (k, nodes per facet)."""
        self._search, self._slave_nodes, self._master_nodes = search, slave_nodes, master_nodes

    @property
    def clearance(self) -> float:
        return self._search.clearance

    def begin_step(self, pressed: Indices) -> None:
        self._search.begin_step(pressed)

    def pairs(
        self, xs: Array, xm: Array, inflation: float, xs_previous: Array, xm_previous: Array
    ) -> NDArray[np.int32]:
        found = self._search.pairs(xs, xm, inflation, xs_previous, xm_previous)
        slave, master = self._slave_nodes[found[:, 0]], self._master_nodes[found[:, 1]]
        return found[~(slave[:, :, None] == master[:, None, :]).any(axis=(1, 2))]


def shared_nodes(slave: Indices, masters: Sequence[Indices]) -> Indices:
    """Nodes of a slave surface that other surfaces, its masters, have, too; all as numbers among all nodes."""
    return np.intersect1d(slave, np.concatenate([np.empty(0, dtype=np.int64), *masters]))
