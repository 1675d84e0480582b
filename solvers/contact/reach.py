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
from solvers.search import Search

#: A step could bring together surfaces whose distance is at most this multiple of the way by velocity, plus this share
#: of an edge of the slave for bodies at rest.
WAYS, EDGES = 2.0, 0.2


class Reach:
    """Finds the present pairs of an interface; all others are tied or in self contact, and always present."""

    def __init__(self, interface: ContactInterface):
        self._nodes = [(interface.nodes_of(pair.slave), interface.nodes_of(pair.master)) for pair in interface.pairs]
        self._searches = [
            None if pair.master is pair.slave or pair.law == Tied() else Search(pair.slave.facets, pair.master.facets)
            for pair in interface.pairs
        ]
        self._edges = [_mean_edge(pair.slave.points, pair.slave.facets) for pair in interface.pairs]

    def find(self, x: Array, way: float, present: NDArray[np.bool_], pressed: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Mask of the pairs that are present in a step that moves nodes by up to `way` [m].

        x: positions [m], shape (N, dim); present: the mask of the last step; pressed: nodes with contact forces, (N,).
        """
        found = np.ones(len(self._searches), dtype=bool)
        for k, (search, (slave, master)) in enumerate(zip(self._searches, self._nodes, strict=True)):
            if search is None or (present[k] and pressed[slave].any()):
                continue
            distance = WAYS * way + EDGES * self._edges[k]
            xs, xm = np.ascontiguousarray(x[slave]), np.ascontiguousarray(x[master])
            found[k] = len(search.pairs(xs, xm, 2.0 * distance if present[k] else distance)) > 0
        return found


def _mean_edge(points: Array, facets: NDArray[np.int64]) -> float:
    return float(np.linalg.norm(points[facets[:, 1]] - points[facets[:, 0]], axis=1).mean()) if len(facets) else 0.0
