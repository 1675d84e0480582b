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
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.distance import distances_in_pairs
from solvers.mesh.periods import box_of, gap_of_boxes, no_periods, way_of, ways_to, without_longer
from solvers.mesh.search import Search

#: A step could bring together surfaces whose distance is at most this multiple of their ways by velocity, plus this
#: share of an edge of the slave for bodies at rest. A body that a constant force accelerates from rest covers 1.5 times
#: its way by velocity in the second step, less in later ones. An impact is the same with 1 to 200 and with 0.002 to 20.
WAYS, EDGES = 2.0, 0.2


class Reach:
    """Finds the present pairs of an interface; those that are tied, in self contact or `always` there are present."""

    def __init__(self, interface: ContactInterface):
        self._surfaces = interface.nodes.of_surface
        self._periods = no_periods(interface.nodes.dim) if interface.periods is None else interface.periods
        self._sides = np.array(
            [[_index(interface, side) for side in (pair.slave, pair.master)] for pair in interface.pairs]
        ).reshape(-1, 2)
        self._selves = [pair.master is pair.slave for pair in interface.pairs]
        watched = [pair.master is not pair.slave and pair.law != Tied() for pair in interface.pairs]
        self._watched = np.array(watched, dtype=bool)
        self._comes = self._watched & ~np.array([pair.always for pair in interface.pairs], dtype=bool)
        self._edges = np.array([_mean_edge(pair.slave.points, pair.slave.facets) for pair in interface.pairs])
        self._facets = [surface.facets for surface in interface.surfaces]
        self._simplices = [np.array(CELL_TYPES[surface.facet_type].simplices) for surface in interface.surfaces]
        self._searches: dict[int, Search] = {}  # created when the boxes of two surfaces first come near
        #: latest search of each pair: positions [m], reach [m], facets (slave, master) and their distances [m]
        self._latest: dict[int, tuple[Array, Array, float, NDArray[np.int32], Array]] = {}

    def find(self, x: Array, ways: Array, present: NDArray[np.bool_], pressed: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Mask of the pairs that are present in a step.

        x: positions [m], ways: displacements by the velocities in the step [m], shape (N, dim); present: the mask of
        the last step; pressed: nodes with contact forces, shape (N,).
        """
        lengths = np.linalg.norm(ways, axis=1)
        way = np.array([lengths[nodes].max(initial=0.0) for nodes in self._surfaces])[self._sides].sum(axis=1)
        distance = (WAYS * way + EDGES * self._edges) * np.where(present, 2.0, 1.0)
        low, high = (np.array([end(x[nodes], axis=0) for nodes in self._surfaces]) for end in (np.min, np.max))
        slave, master = self._sides.T
        apart = gap_of_boxes((low[slave], high[slave]), (low[master], high[master]), self._periods)
        touching = present & np.array([pressed[self._surfaces[side]].any() for side in slave], dtype=bool)
        found = ~self._comes | touching | (apart <= distance)
        for pair in np.flatnonzero(found & self._comes & ~touching):
            found[pair] = len(self._within(pair, x, float(distance[pair]))) > 0
        return found

    def nodes(self, x: Array, ways: Array, present: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Mask of the nodes of present pairs that their velocities could bring into contact in a step, shape (N,).

        Of self contact all nodes. x, ways: as in `find`.
        """
        found, lengths = np.zeros(len(x), dtype=bool), np.linalg.norm(ways, axis=1)
        for pair in np.flatnonzero(present):
            sides = self._sides[pair]
            numbers = [self._surfaces[side] for side in sides]
            if self._selves[pair]:
                found[numbers[0]] = True
            if not self._watched[pair]:
                continue
            distance = WAYS * float(sum(lengths[nodes].max(initial=0.0) for nodes in numbers))
            near = self._within(pair, x, distance)
            for side, nodes, facets in zip(sides, numbers, near.T, strict=True):
                found[nodes[self._facets[side][facets]]] = True
        return found

    def _within(self, pair: int, x: Array, distance: float) -> NDArray[np.int32]:
        """Facets (slave, master) of a pair up to a distance [m] at the positions x [m] of all nodes, shape (p, 2).

        `find` and `nodes` ask at the same positions in a step, `nodes` for no larger distance: one search serves both.
        """
        sides = self._sides[pair]
        xs, xm = (np.ascontiguousarray(x[self._surfaces[side]]) for side in sides)
        known = self._latest.get(pair)
        if known is None or known[2] < distance or not (np.array_equal(known[0], xs) and np.array_equal(known[1], xm)):
            if pair not in self._searches:
                self._searches[pair] = Search(*(self._facets[side] for side in sides))
            parts = []
            for periods in ways_to(box_of(xs), box_of(xm), without_longer(xm, self._periods), distance):
                image = xm + way_of(periods, self._periods)
                candidates = self._searches[pair].pairs(xs, image, distance)
                parts.append((candidates, self._distances(sides, candidates, xs, image)))
            none = np.empty((0, 2), dtype=np.int32), np.empty(0)
            candidates, distances = (np.concatenate(some) for some in zip(none, *parts, strict=True))
            known = xs, xm, distance, candidates, distances
            self._latest[pair] = known
        return known[3][known[4] <= distance]

    def _distances(self, sides: NDArray[np.int64], pairs: NDArray[np.int32], xs: Array, xm: Array) -> Array:
        """The least distance [m] of a node of one facet to the other one, by pairs of facets.

        The boxes of the search are those of a frame: what they find depends on how the scene is turned.
        """
        slave, master = (self._facets[side][number] for side, number in zip(sides, pairs.T, strict=True))
        ways = (xs[slave], xm[master], self._simplices[sides[1]]), (xm[master], xs[slave], self._simplices[sides[0]])
        least = np.full(len(pairs), np.inf)
        for points, facets, simplices in ways:
            corners = facets[:, simplices][:, None]  # (pairs, 1, simplices, dim, dim)
            nodes = points[:, :, None]  # (pairs, nodes, 1, dim)
            shape = (*np.broadcast_shapes(nodes.shape[:3], corners.shape[:3]), points.shape[2])
            found = distances_in_pairs(
                np.broadcast_to(nodes, shape).reshape(-1, shape[3]),
                np.broadcast_to(corners, (*shape[:3], *corners.shape[3:])).reshape(-1, *corners.shape[3:]),
            )
            np.minimum(least, found.reshape(len(pairs), shape[1] * shape[2]).min(axis=1), out=least)
        return least


def _index(interface: ContactInterface, surface: Surface) -> int:
    return next(k for k, other in enumerate(interface.surfaces) if other is surface)


def _mean_edge(points: Array, facets: NDArray[np.int64]) -> float:
    return float(np.linalg.norm(points[facets[:, 1]] - points[facets[:, 0]], axis=1).mean()) if len(facets) else 0.0


def touching_dofs(interface: ContactInterface, present: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Global dofs of the nodes of surfaces of present pairs that are not tied, each once."""
    pairs = [pair for pair, here in zip(interface.pairs, present, strict=True) if here and pair.law != Tied()]
    dofs = interface.nodes.dofs[interface.mask([side for pair in pairs for side in (pair.slave, pair.master)])]
    return dofs[dofs >= 0]


def multiplier_dofs(interface: ContactInterface, present: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Global dofs of slave nodes of present pairs that are not tied."""
    multipliers = interface.multipliers
    near = interface.mask([pair.slave for pair, here in zip(interface.pairs, present, strict=True) if here])
    slaves = (multipliers.areas > 0.0) & (interface.spans != "space") & near[multipliers.node]
    return interface.nodes.dofs[np.unique(multipliers.node[slaves])].ravel()
