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
#: from one of them; without this it would not be seen until the body has turned into it. From 0.01 to 1 motions of a
#: stack of bars that falls are the same.
TILT = 0.1

#: Overlap at the start of a step, relative to the extent of the smaller body, from which on edges do not touch: they
#: are on the sides of the bodies that look away. The overlap of a solution is rounding, and bodies are thicker: from
#: 1e-7 to 1e-2 those motions are the same.
FAR_BEHIND = 1e-4


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
class PlacedEdges:
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
    ) -> PlacedEdges:
        """Those near a box; x: vertices of the surface [m]; facets: those of the surface."""
        beyond = np.concatenate([x < box[0] - margin, x > box[1] + margin], axis=1) @ (1 << np.arange(6))
        one_end, other_end = edges.ends.T
        number = np.flatnonzero(beyond[one_end] & beyond[other_end] == 0)  # not both beyond the same side
        ends = x[edges.ends[number]]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        along = (ends[:, 1] - ends[:, 0]) / length[:, None]
        one, other = edges.facets[number].T
        n = _normals(x, facets[one])
        inwards = np.cross(n, along)
        rim = (other < 0)[:, None]
        beside = np.where(rim, -inwards, _normals(x, facets[other]))
        inwards_beside = np.where(rim, -n, np.cross(along, beside))
        return cls(number, ends[:, 0], along, length, np.stack([inwards, inwards_beside], axis=1), n + beside)

    def __getitem__(self, which: NDArray) -> PlacedEdges:
        return PlacedEdges(
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

    one: PlacedEdges  #: the edge of the body
    other: PlacedEdges  #: that of the surface
    gap: Array  #: [m]
    normal: Array  #: unit vectors from the surface to the body, shape (m, 3)
    at: Array  #: points on the edges of the body [m], shape (m, 3)

    def __getitem__(self, which: NDArray) -> Crossings:
        return Crossings(self.one[which], self.other[which], self.gap[which], self.normal[which], self.at[which])


def crossings(one: PlacedEdges, other: PlacedEdges, margin: float, deepest: float) -> Crossings:
    """The pairs whose gap is between -deepest and margin [m], and less than the longer of both edges.

    Within surfaces of short edges vertices are as near, and edges that are deeper than they are long are not those that
    meet.
    """
    first, second = _near_each_other(one, other, max(margin, deepest))
    along, along_other = one.along[first], other.along[second]
    way, cosine = other.first[second] - one.first[first], np.einsum("md,md->m", along, along_other)
    on_one, on_other = (np.einsum("md,md->m", way, some) for some in (along, along_other))
    square = 1.0 - cosine**2
    crossing = square > SINE**2
    square = np.where(crossing, square, 1.0)
    share, share_other = (on_one - cosine * on_other) / square, (cosine * on_one - on_other) / square
    crossing &= (share > 0.0) & (share < one.length[first])
    crossing &= (share_other > 0.0) & (share_other < other.length[second])
    one, other, share, way = one[first[crossing]], other[second[crossing]], share[crossing], way[crossing]
    normal = _unit(np.cross(one.along, other.along))
    normal *= np.where(np.einsum("md,md->m", normal, other.outward - one.outward) < 0.0, -1.0, 1.0)[:, None]
    gap = -np.einsum("md,md->m", way, normal)
    near = (gap < margin) & (gap > -deepest) & (np.abs(gap) < np.maximum(one.length, other.length))
    at = one.first + share[:, None] * one.along
    return Crossings(one, other, gap, normal, at)[near & other.allow(normal) & one.allow(-normal)]


def gaps_of_lines(first: tuple[Array, Array], second: tuple[Array, Array], n: Array) -> Array:
    """Gaps [m] of the lines through the ends of edges, along the normals nearest to n, shape (m,)."""
    normal = np.cross(first[1] - first[0], second[1] - second[0])
    normal *= np.sign(np.einsum("md,md->m", normal, n))[:, None]
    return np.asarray(np.einsum("md,md->m", first[0] - second[0], _unit(normal)))


def _near_each_other(
    one: PlacedEdges, other: PlacedEdges, within: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Places of all pairs that may be nearer than `within` and than the longer edge.

    There are few: edges are convex, so that surfaces with many are near each other in small parts.
    """
    from scipy.spatial.distance import cdist  # the import takes long: only runs with contact need it

    middles = (edges.first + 0.5 * edges.length[:, None] * edges.along for edges in (one, other))
    lengths = one.length[:, None], other.length[None]
    reach = np.minimum(within, np.maximum(*lengths)) + 0.5 * (lengths[0] + lengths[1])
    first, second = np.nonzero(cdist(*middles) <= reach)
    return first, second


def _normals(x: Array, facets: NDArray[np.int64]) -> Array:
    corners = x[facets]
    return _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])
