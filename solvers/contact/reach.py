"""Which contact pairs are present: those that a step could bring into contact.

A pair is present from the step on that could bring its surfaces together, until they are twice that far apart. In
dynamics only surfaces of present pairs are without mass.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.interface import ContactInterface
from solvers.contact.law.tied import Tied
from solvers.contact.surface import Surface
from solvers.search import Search

#: A step could bring together surfaces whose distance is at most this multiple of their ways by velocity, plus this
#: share of an edge of the slave for bodies at rest.
WAYS, EDGES = 2.0, 0.2


class Reach:
    """Finds the present pairs of an interface; all others are tied or in self contact, and always present."""

    def __init__(self, interface: ContactInterface):
        self._surfaces = interface.nodes.of_surface
        self._sides = np.array(
            [[_index(interface, side) for side in (pair.slave, pair.master)] for pair in interface.pairs]
        ).reshape(-1, 2)
        self._watched = np.array([pair.master is not pair.slave and pair.law != Tied() for pair in interface.pairs])
        self._edges = np.array([_mean_edge(pair.slave.points, pair.slave.facets) for pair in interface.pairs])
        self._facets = [surface.facets for surface in interface.surfaces]
        self._searches: dict[int, Search] = {}  # created when the boxes of two surfaces first come near

    def find(self, x: Array, ways: Array, present: NDArray[np.bool_], pressed: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Mask of the pairs that are present in a step.

        x: positions [m], ways: displacements by the velocities in the step [m], shape (N, dim); present: the mask of
        the last step; pressed: nodes with contact forces, shape (N,).
        """
        way = np.array([np.abs(ways[nodes]).max(initial=0.0) for nodes in self._surfaces])[self._sides].sum(axis=1)
        distance = (WAYS * way + EDGES * self._edges) * np.where(present, 2.0, 1.0)
        low, high = (np.array([end(x[nodes], axis=0) for nodes in self._surfaces]) for end in (np.min, np.max))
        slave, master = self._sides.T
        apart = np.maximum(low[slave] - high[master], low[master] - high[slave]).max(axis=1, initial=-np.inf)
        touching = present & np.array([pressed[self._surfaces[side]].any() for side in slave], dtype=bool)
        found = ~self._watched | touching | (apart <= distance)
        for pair in np.flatnonzero(found & self._watched & ~touching):
            sides = self._sides[pair]
            if pair not in self._searches:
                self._searches[pair] = Search(*(self._facets[side] for side in sides))
            xs, xm = (np.ascontiguousarray(x[self._surfaces[side]]) for side in sides)
            found[pair] = len(self._searches[pair].pairs(xs, xm, float(distance[pair]))) > 0
        return found


def _index(interface: ContactInterface, surface: Surface) -> int:
    return next(k for k, other in enumerate(interface.surfaces) if other is surface)


def _mean_edge(points: Array, facets: NDArray[np.int64]) -> float:
    return float(np.linalg.norm(points[facets[:, 1]] - points[facets[:, 0]], axis=1).mean()) if len(facets) else 0.0
