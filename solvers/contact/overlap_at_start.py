"""Facets that lie in the other body at the start of a run, by more than the search of contact looks for.

The search finds masters up to a slave facet's edge behind it, because farther behind a thin wall lies its other side.
Here the solids of both bodies are known, so that no other side is mistaken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices
from solvers.contact.surface import longest_edge
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.penetration import depths, inside
from solvers.mesh.search import OPPOSED, Search
from solvers.mesh.tessellation import unit_normals

#: Depth, relative to the longest edge of the slave, up to which facets are left to the search.
LEFT = 0.5


@dataclass(frozen=True)
class SolidSide:
    """One side of a pair at the start, with the body that it belongs to."""

    x: Array  #: positions [m] of its nodes, shape (n, dim)
    facets: Indices  #: outward oriented, shape (k, nodes per facet)
    facet_type: str
    solid: Array  #: corners [m] of the whole surface of the body, shape (m, dim, dim)

    @property
    def simplices(self) -> Array:
        """Corners [m] of the flat pieces of all facets, shape (pieces, dim, dim)."""
        split = np.array(CELL_TYPES[self.facet_type].simplices)
        return self.x[self.facets[:, split].reshape(-1, split.shape[1])]

    @property
    def corners(self) -> Array:
        """Corners [m] of the facets, shape (k, corners, dim)."""
        return self.x[self.facets[:, : CELL_TYPES[self.facet_type].corners]]

    @property
    def normals(self) -> Array:
        """Mean unit normals of the facets, shape (k, dim)."""
        pieces = unit_normals(self.simplices).reshape(len(self.facets), -1, self.x.shape[1]).mean(axis=1)
        return pieces / np.linalg.norm(pieces, axis=1, keepdims=True)


def overlapping_facets(slave: SolidSide, master: SolidSide) -> NDArray[np.int32]:
    """Pairs (slave facet, master facet) of which one lies deep in the other body, and that face each other, (p, 2)."""
    none = np.empty((0, 2), dtype=np.int32)
    edge = longest_edge(slave.corners)
    deep_slave, deep_master = _depths(slave, master, LEFT * edge), _depths(master, slave, LEFT * edge)
    deepest = max(deep_slave.max(initial=0.0), deep_master.max(initial=0.0))
    if deepest == 0.0:
        return none
    radii = edge + np.where(deep_slave > 0.0, deep_slave, deep_master.max(initial=0.0))
    s, m = Search(slave.facets, master.facets).pairs(slave.x, master.x, radii).T
    away = master.corners.mean(axis=1)[m] - slave.corners.mean(axis=1)[s]
    of_slave, of_master = slave.normals[s], master.normals[m]
    wanted = (deep_slave[s] > 0.0) | (deep_master[m] > 0.0)
    wanted &= np.einsum("pd,pd->p", of_slave, of_master) < OPPOSED
    wanted &= (np.einsum("pd,pd->p", away, of_slave) < 0.0) & (np.einsum("pd,pd->p", away, of_master) > 0.0)
    return np.stack([s[wanted], m[wanted]], axis=1).astype(np.int32)


def _depths(side: SolidSide, other: SolidSide, least: float) -> Array:
    """Largest depth [m] of points of each facet in the other body, below its side of the pair, shape (k,).

    Zero up to the least depth [m].
    """
    found = np.zeros(len(side.facets))
    low, high = other.solid.min(axis=(0, 1)), other.solid.max(axis=(0, 1))
    corners = side.corners
    points = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1)
    facet = np.arange(len(corners)).repeat(points.shape[1])
    points = points.reshape(-1, points.shape[2])
    near = ((points > low) & (points < high)).all(axis=1)
    near[near] = inside(points[near], other.solid)
    np.maximum.at(found, facet[near], depths(points[near], other.simplices, np.full(near.sum(), least)))
    return found
