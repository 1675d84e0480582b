"""Sharp edges of two rigid surfaces that cross in space: points of contact between the vertices.

The lines of two edges are nearest to each other along n = a x b / |a x b|, a and b being the unit vectors along them.
The points there touch where both are between the ends of their edges and n is among the normals of both surfaces there:
it is out of the one between the normals of the two facets at its edge, and into the other one. Faces that lie on each
other touch there, too, where an edge of one crosses an edge of the other: these points are the corners of the area in
common that no vertex has.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array

#: Sine of the angle between facets, and of that between edges, below which it is rounding.
SINE = 1e-6

#: What a normal may miss of those at an edge, as a sine. A body that lies on two edges tilts in an iterate, and away
#: from one of them; without this it would not be seen until the body has turned into it. Solutions do not depend on it.
TILT = 0.1

#: Overlap at the start of a step, relative to the extent of the smaller body, from which on edges do not touch: they
#: are on the sides of the bodies that look away. The overlap of a solution is rounding, and bodies are thicker: from
#: 1e-6 to 1e-2 results are the same.
BEHIND = 1e-4


@dataclass(frozen=True)
class Edges:
    """Convex edges of a surface of triangles, and the rims where it ends."""

    ends: NDArray[np.int64]  #: vertices, in the direction of the first facet, shape (e, 2)
    facets: NDArray[np.int64]  #: both facets, -1: none beside a rim, shape (e, 2)

    @classmethod
    def of(cls, points: Array, facets: NDArray[np.int64]) -> Edges:
        """Those of a surface with outward right-hand normals."""
        ends = np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]])
        facet, opposite = np.tile(np.arange(len(facets)), 3), np.concatenate([facets[:, 2], facets[:, 0], facets[:, 1]])
        order = np.lexsort(np.sort(ends, axis=1).T)
        both = np.sort(ends[order], axis=1)
        new = np.append(True, (both[1:] != both[:-1]).any(axis=1))
        starts, counts = np.flatnonzero(new), np.diff(np.append(np.flatnonzero(new), len(new)))
        rims, inner = order[starts[counts == 1]], starts[counts == 2]
        one, other = order[inner], order[inner + 1]
        normals = _normals(points, facets[facet[one]])
        along = _unit(points[ends[one, 1]] - points[ends[one, 0]])
        beyond = points[opposite[other]] - points[ends[one, 0]]
        beyond -= np.einsum("nd,nd->n", beyond, along)[:, None] * along
        convex = np.einsum("nd,nd->n", normals, _unit(beyond)) < -SINE
        one, other = one[convex], other[convex]
        beside = np.stack([facet[one], facet[other]], axis=1)
        ended = np.stack([facet[rims], np.full(len(rims), -1)], axis=1)
        return cls(np.concatenate([ends[one], ends[rims]]), np.concatenate([beside, ended]))


@dataclass(frozen=True)
class Placed:
    """Some edges of a surface at one time."""

    number: NDArray[np.int64]  #: among those of the surface, shape (k,)
    first: Array  #: one end [m], shape (k, 3)
    along: Array  #: unit vectors to the other end, shape (k, 3)
    length: Array  #: [m], shape (k,)
    inwards: Array  #: unit vectors in both facets, away from the edge, shape (k, 2, 3)
    outward: Array  #: sums of the normals of both facets, shape (k, 3)

    @classmethod
    def within(
        cls, edges: Edges, x: Array, facets: NDArray[np.int64], box: tuple[Array, Array], margin: float
    ) -> Placed:
        """Those near a box; x: vertices of the surface [m]; facets: those of the surface."""
        ends = x[edges.ends]
        near = (ends.max(axis=1) >= box[0] - margin) & (ends.min(axis=1) <= box[1] + margin)
        number = np.flatnonzero(near.all(axis=1))
        ends = ends[number]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        along = (ends[:, 1] - ends[:, 0]) / length[:, None]
        one, other = edges.facets[number].T
        n = _normals(x, facets[one])
        inwards = np.cross(n, along)
        rim = (other < 0)[:, None]
        beside = np.where(rim, -inwards, _normals(x, facets[other]))
        inwards_beside = np.where(rim, -n, np.cross(along, beside))
        return cls(number, ends[:, 0], along, length, np.stack([inwards, inwards_beside], axis=1), n + beside)

    def __getitem__(self, which: NDArray) -> Placed:
        return Placed(
            self.number[which],
            self.first[which],
            self.along[which],
            self.length[which],
            self.inwards[which],
            self.outward[which],
        )

    def allow(self, n: Array) -> NDArray[np.bool_]:
        """Whether n is among the normals of the edge of the same number, shape (k,)."""
        return (np.einsum("kfd,kd->kf", self.inwards, n) <= TILT).all(axis=1)


@dataclass(frozen=True)
class Crossings:
    """Pairs of edges that cross, shape (m,)."""

    one: Placed  #: the edge of the body
    other: Placed  #: that of the surface
    gap: Array  #: [m]
    normal: Array  #: unit vectors from the surface to the body, shape (m, 3)
    at: Array  #: points on the edges of the body [m], shape (m, 3)

    def __getitem__(self, which: NDArray) -> Crossings:
        return Crossings(self.one[which], self.other[which], self.gap[which], self.normal[which], self.at[which])


def crossings(one: Placed, other: Placed, margin: float, deepest: float) -> Crossings:
    """The pairs whose gap is between -deepest and margin [m]."""
    first, second = _near_each_other(one, other, max(margin, deepest))
    one, other = one[first], other[second]
    normal = np.cross(one.along, other.along)
    sine = np.linalg.norm(normal, axis=1)
    crossing = np.flatnonzero(sine > SINE)
    one, other, sine = one[crossing], other[crossing], sine[crossing]
    across = normal[crossing] / sine[:, None]
    way = other.first - one.first
    gap = -np.einsum("md,md->m", way, across)
    share = np.einsum("md,md->m", np.cross(way, other.along), across) / sine
    share_other = np.einsum("md,md->m", np.cross(way, one.along), across) / sine
    sign = np.where(np.einsum("md,md->m", across, other.outward - one.outward) < 0.0, -1.0, 1.0)
    across, gap = sign[:, None] * across, sign * gap
    inside = (share > 0.0) & (share < one.length) & (share_other > 0.0) & (share_other < other.length)
    chosen = np.flatnonzero(inside & (gap < margin) & (gap > -deepest) & other.allow(across) & one.allow(-across))
    one = one[chosen]
    return Crossings(one, other[chosen], gap[chosen], across[chosen], one.first + share[chosen, None] * one.along)


def gaps_of_lines(first: tuple[Array, Array], second: tuple[Array, Array], n: Array) -> Array:
    """Gaps [m] of the lines through the ends of edges, along the normals nearest to n, shape (m,)."""
    normal = np.cross(first[1] - first[0], second[1] - second[0])
    normal *= np.sign(np.einsum("md,md->m", normal, n))[:, None]
    return np.asarray(np.einsum("md,md->m", first[0] - second[0], _unit(normal)))


def _near_each_other(one: Placed, other: Placed, within: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Places of all pairs that may be nearer than `within`. Edges of about the same length have a tree."""
    from scipy.spatial import cKDTree

    first, second = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    sorted_by_length = [[np.flatnonzero(size == k) for k in np.unique(size)] for size in _sizes(one, other)]
    for own in sorted_by_length[0]:
        tree = cKDTree(_middles(one, own))
        for beside in sorted_by_length[1]:
            reach = within + 0.5 * float(one.length[own].max() + other.length[beside].max())
            found = tree.query_ball_point(_middles(other, beside), reach)
            second.append(np.repeat(beside, [len(some) for some in found]))
            first.append(own[np.concatenate([np.empty(0), *found]).astype(np.int64)])
    return np.concatenate(first), np.concatenate(second)


def _sizes(*edges: Placed) -> list[NDArray[np.int64]]:
    return [np.frexp(some.length)[1].astype(np.int64) for some in edges]


def _middles(edges: Placed, which: NDArray[np.int64]) -> Array:
    return edges.first[which] + 0.5 * edges.length[which, None] * edges.along[which]


def _normals(x: Array, facets: NDArray[np.int64]) -> Array:
    corners = x[facets]
    return _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])
