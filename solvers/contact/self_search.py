"""Search in self contact: facet pairs of one surface, and which facet of a pair is the slave."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.connected import connected_parts
from solvers.api import Array, FailureKind, Indices, StepFailed
from solvers.contact.dual_tree import DualTree
from solvers.mesh.search import Search
from solvers.mesh.wall_thickness import wall_thickness

Roles = NDArray[np.int8]

SLAVE, MASTER = 1, 2  #: roles of facets; 0 is none


#: Overlap relative to the thickness of the wall above which a pair is the two sides of the wall. From 0.001 to 0.8
#: results are the same.
THROUGH = 0.5


class SelfSearch:
    """Pairs (slave facet, master facet) of one surface; roles are chosen in each step and kept within it.

    The opposite side of its own wall is like a master that a facet has penetrated by the thickness of the wall. Hence
    pairs that overlap by more than half of the thickness are excluded.
    """

    clearance = -np.inf  #: [m]; a surface is never clear of itself

    def __init__(self, facets: Indices, facet_type: str, points: Array, others: Indices | None = None):
        """points: reference positions [m] of the nodes, shape (n, dim); others: facets of other bodies, whose
        nodes are numbered after these."""
        self.tree = DualTree(facets, facet_type, points)
        self._others = None if others is None or len(others) == 0 else Search(facets, others)
        self._count, self._nodes = len(facets), len(points)
        self._thickness = wall_thickness(points[facets].mean(axis=1), self._normals(points))
        self._pressed = np.zeros(self._count, dtype=np.int64)
        self._roles = np.zeros(self._count, dtype=np.int8)
        self._directed = np.empty(0, dtype=np.int64)  # codes of directed pairs, sorted

    def begin_step(self, pressed: NDArray[np.int64]) -> None:
        """Discard the roles; pressed: count of multipliers in contact of each facet, (k,), which are slaves again."""
        self._pressed = pressed
        self._roles = np.zeros(self._count, dtype=np.int8)
        self._directed = np.empty(0, dtype=np.int64)

    def pairs(
        self, xs: Array, xm: Array, inflation: float, xs_previous: Array | None = None, xm_previous: Array | None = None
    ) -> NDArray[np.int32]:
        """Facet pairs as in `Search.pairs`; xm: positions of its own nodes, then of those of `others`."""
        n = self._nodes
        own_x, own_previous = xm[:n], None if xm_previous is None else xm_previous[:n]
        own = self._own_pairs(own_x, inflation, own_previous)
        if self._others is None:
            return own
        beside = self._others.pairs(own_x, xm, inflation, own_previous, xm_previous)
        found = np.concatenate([own, beside + np.array([0, self._count], dtype=np.int32)])
        return np.ascontiguousarray(found[np.lexsort(found.T[::-1])])

    def _own_pairs(self, xs: Array, inflation: float, xs_previous: Array | None) -> NDArray[np.int32]:
        if not np.isfinite(xs).all():
            reason = "positions of contact surfaces are not finite: take a smaller time step"
            raise StepFailed("contact", FailureKind.NOT_FINITE, reason)
        found = self.tree.pairs(xs, inflation, xs_previous)
        found = found[~self._through_the_wall(found, xs)]
        found = found[~self._apart(found, [xs] if xs_previous is None else [xs, xs_previous], inflation)]
        k = self._count
        has_roles = np.isin(found @ [k, 1], self._directed) | np.isin(found @ [1, k], self._directed)
        new = found[~has_roles]
        if len(new):
            self._roles = choose_roles(self._roles, self._pressed, found)
            turned = (self._roles[new[:, 0]] == MASTER) & (self._roles[new[:, 1]] == SLAVE)
            new[turned] = new[turned][:, ::-1]
            self._directed = np.union1d(self._directed, new @ [k, 1])
        forward, backward = found @ [k, 1], found @ [1, k]
        codes = np.sort(np.where(np.isin(forward, self._directed), forward, backward))
        return np.stack([codes // k, codes % k], axis=1).astype(np.int32)

    def _normals(self, x: Array) -> Array:
        mean = self.tree.normals(x).mean(axis=1)
        return mean / np.linalg.norm(mean, axis=1, keepdims=True)

    def _apart(self, pairs: Indices, path: list[Array], inflation: float) -> NDArray[np.bool_]:
        """Mask of the pairs that a plane keeps farther apart than `inflation` [m] all along their path.

        Its normal is that of a facet or the line between their middles. The directions of the tree are those of the
        axes, so that what it finds besides, and with it who becomes a slave, would depend on the rotation of a scene.
        """
        i, j = pairs.T
        at = np.concatenate([x[self.tree.facets] for x in path], axis=1)
        middles, normals = at.mean(axis=1), self._normals(path[0])
        between = middles[j] - middles[i]
        between /= np.maximum(np.linalg.norm(between, axis=1, keepdims=True), np.finfo(float).tiny)
        apart = np.zeros(len(pairs), dtype=bool)
        for direction in (normals[i], normals[j], between):
            first, second = (np.einsum("pnd,pd->pn", at[k], direction) for k in (i, j))
            apart |= second.min(axis=1) - first.max(axis=1) > inflation
            apart |= first.min(axis=1) - second.max(axis=1) > inflation
        return apart

    def _through_the_wall(self, pairs: Indices, x: Array) -> NDArray[np.bool_]:
        normals, middles = self._normals(x), x[self.tree.facets].mean(axis=1)
        i, j = pairs.T
        overlap = -0.5 * np.einsum("pd,pd->p", middles[j] - middles[i], normals[i] - normals[j])
        return overlap > THROUGH * np.minimum(self._thickness[i], self._thickness[j])


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
