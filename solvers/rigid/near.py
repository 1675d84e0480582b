"""Which vertices of rigid bodies, obstacles and walls are near another surface, and how they move relative to it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.mesh.periods import gap_of_boxes, no_periods, way_of, ways_to, without_longer
from solvers.rigid.body import RigidBody, in_space
from solvers.rigid.coulomb import Touch
from solvers.rigid.edges import FAR_BEHIND, Crossings, Edges, PlacedEdges, crossings, gaps_of_lines
from solvers.rigid.gaps import Gaps, RigidWall, gaps, unit_normals
from solvers.rigid.motion import RigidInstant
from solvers.rigid.surface import positions

#: Share of the extent of a body up to which vertices of others are near it. They are looked at again in each iterate,
#: so that the result does not depend on it.
NEAR_BODY = 0.25

#: Share of the extent of a body up to which the boxes of two are looked into: between iterates bodies move by less, as
#: the first one has the velocities of the step before. Another body that is hit is seen in the next iterate. From 0.01
#: to 0.25 piles of discs move alike, in as many iterations; with 0.25 a step costs a third more.
NEAR_BOXES = 0.05


#: Number of the edges that cross at a vertex.
NO_EDGE = np.array(-1)

#: Images along an axis that have numbers of their own, those of both directions.
IMAGES = 2**12


@dataclass(frozen=True)
class Obstacle:
    """A rigid obstacle of segments or triangles, whose right-hand normals point towards the bodies."""

    name: str
    points: Array  #: vertices [m], shape (n, dim)
    facets: NDArray[np.int64]  #: shape (m, dim)
    motion: Callable[[float], Array] | None = None  #: time [s] -> positions of the vertices [m]; None: it rests

    def at(self, t: float) -> Array:
        """Positions [m] of the vertices at the time t [s]."""
        return self.points if self.motion is None else self.motion(t)

    @cached_property
    def edges(self) -> Edges:
        """Its sharp edges, in 3D."""
        return Edges.of(self.points, self.facets)


@dataclass(frozen=True)
class RigidPair:
    """A body that may touch another one, an obstacle or a wall."""

    body: int  #: index of the body
    other: int | Obstacle | RigidWall  #: index of the other body, or what it is
    friction: float = 0.0  #: Coulomb's coefficient


@dataclass(frozen=True)
class Moment:
    """All bodies at the end of a step."""

    bodies: Sequence[RigidBody]
    now: Sequence[RigidInstant]
    old: Sequence[RigidInstant]  #: at the start of the step
    t: float  #: [s]
    dt: float  #: [s]

    def centre(self, body: int) -> Array:
        """[m], shape (dim,)."""
        return self.bodies[body].inertia.centre + self.now[body].shift[: self.bodies[body].dim]

    def carried(self, body: int, points: Array) -> Array:
        """Displacements [m] in the step of the points of a body that are at `points` now, shape (n, dim)."""
        now, old, dim = self.now[body], self.old[body], points.shape[1]
        arms = in_space(points - self.centre(body))
        return (now.shift - old.shift)[:dim] + (arms - arms @ (old.R @ now.R.T).T)[:, :dim]


@dataclass(frozen=True)
class _Side:
    """A surface at one time."""

    of: RigidBody | Obstacle
    body: int  #: index of its body, -1 of an obstacle
    x: Array  #: positions of the vertices [m], shape (n, dim)
    facets: NDArray[np.int64]
    moved: Array | None  #: displacements of the vertices of an obstacle in the step [m]; None: it rests, or is a body
    way: Array | None = None  #: by whole periods, of an image [m], shape (dim,)

    @cached_property
    def extent(self) -> float:
        """The largest extent [m] along an axis."""
        return float(np.ptp(self.x, axis=0).max())

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Lowest and highest coordinates [m]."""
        return self.x.min(axis=0), self.x.max(axis=0)

    @cached_property
    def outward(self) -> Array:
        """Sums of the unit normals of the facets at the vertices, shape (n, dim)."""
        found = np.zeros_like(self.x)
        normals = unit_normals(self.x[self.facets])
        for corner in self.facets.T:
            np.add.at(found, corner, normals)
        return found

    def edges_near(self, other: _Side, margin: float) -> PlacedEdges:
        """Sharp edges near the box of another surface."""
        return PlacedEdges.within(self.of.edges, self.x, self.facets, other.box, margin)

    def before(self, x: Array, facets: NDArray[np.int64], moment: Moment) -> Array:
        """Positions [m] at the start of the step of what is at the points x of facets now, shape (n, 3)."""
        if self.body >= 0:
            return x - moment.carried(self.body, x if self.way is None else x - self.way)
        return x if self.moved is None else x - _moved_below(x, self, facets)

    def image(self, way: Array) -> _Side:
        """The image some periods further."""
        return replace(self, x=self.x + way, way=way) if way.any() else self


@dataclass(frozen=True)
class Near:
    """Vertices near another surface, and points where edges of both cross, shape (m,).

    Frames have the normal as their first row, then the tangents.
    """

    vertex: NDArray[np.int64]  #: numbers among those of all pairs; where edges cross an end of the first one
    edge: NDArray[np.int64]  #: number of the pair of edges that cross, -1: a vertex
    body: NDArray[np.int64]  #: indices of the bodies of the vertex and of the surface, -1: none, shape (m, 2)
    way: Array  #: by whole periods, from the surface to its image that the vertex is near [m], shape (m, dim)
    gap: Array  #: [m]
    frame: Array  #: unit vectors, shape (m, dim, dim)
    x: Array  #: positions of the vertices, or on the first edges [m], shape (m, dim)
    carried: Array  #: displacements in the step of the vertices relative to the surface [m], shape (m, dim)
    given: Array  #: the same, by motions of obstacles alone [m], shape (m, dim)
    friction: Array  #: coefficients
    facet: NDArray[np.int64]  #: of the surface, shape (m,)
    along: Array  #: unit vectors along both edges, zero at a vertex, shape (m, 2, dim)

    @classmethod
    def joined(cls, parts: Sequence[Near], dim: int) -> Near:
        """One of many."""
        if not parts:
            vectors, ones = np.empty((0, dim)), np.empty(0)
            numbers = np.empty(0, dtype=np.int64)
            frame = np.empty((0, dim, dim))
            pairs = numbers.reshape(0, 2)
            return cls(
                numbers, numbers, pairs, vectors, ones, frame, vectors, vectors, vectors, ones, numbers, frame[:, :2]
            )
        return cls(*(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(cls)))

    def __getitem__(self, which: NDArray) -> Near:
        return Near(*(getattr(self, one.name)[which] for one in fields(self)))

    def names(self) -> NDArray[np.int64]:
        """What tells them apart, shape (m, 2)."""
        return np.stack([self.vertex, self.edge], axis=1)

    def both(self) -> NDArray[np.int64]:
        """Pairs of bodies that are near each other, each several times, shape (n, 2)."""
        return self.body[(self.body >= 0).all(axis=1)]

    def arms(self, moment: Moment) -> Array:
        """Vectors from the centres of both bodies to the vertex and to its foot [m], shape (m, 2, 3)."""
        centres = np.array([moment.centre(index) for index in range(len(moment.bodies))])
        ends = np.stack([self.x, self.x - self.gap[:, None] * self.frame[:, 0] - self.way], axis=1)
        found = ends - centres[np.maximum(self.body, 0)]
        return np.pad(found, ((0, 0), (0, 0), (0, 3 - found.shape[2])))

    def touch(self, moment: Moment, components: NDArray[np.int64], free: NDArray[np.bool_]) -> Touch:
        """Relative motions in the frames; components: the unknowns of a body; free: mask of those not held."""
        frame = np.pad(self.frame, ((0, 0), (0, 0), (0, 3 - self.frame.shape[2])))[:, None]
        turning = np.cross(self.arms(moment)[:, :, None], frame)
        whole = np.concatenate([np.broadcast_to(frame, turning.shape), turning], axis=3)[..., components]
        signs = np.where(self.body < 0, 0.0, [1.0, -1.0])
        open_ways = free.reshape(-1, len(components))[np.maximum(self.body, 0)]
        return Touch(whole * signs[:, :, None, None] * open_ways[:, :, None], self.body, self.friction)

    def in_frame(self, vectors: Array) -> Array:
        """Components of vectors (m, dim) in the frames."""
        return np.einsum("mde,me->md", self.frame, vectors)


def same_rows(one: NDArray[np.int64], other: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Places in both of the rows that both have, each once; shapes (n, 2) and (m, 2)."""
    number = np.unique(np.concatenate([one, other]), axis=0, return_inverse=True)[1].ravel()
    return np.intersect1d(number[: len(one)], number[len(one) :], return_indices=True)[1:]


def vertices(bodies: Sequence[RigidBody], pair: RigidPair) -> int:
    """Vertices of both sides of a pair."""
    count, other = len(bodies[pair.body].points), pair.other
    if isinstance(other, RigidWall):
        return count
    return count + len(bodies[other].points if isinstance(other, int) else other.points)


def search(
    pairs: Sequence[RigidPair],
    starts: Sequence[int],
    moment: Moment,
    kept: Near | None = None,
    lengths: Array | None = None,
) -> Near:
    """All vertices that are near; starts: number of the first vertex of each pair, then of all vertices.

    kept: vertices that it has keep their facets there, whose planes they face. lengths: periods [m], None: no space
    repeats. Beside an image of a surface, a vertex has another number: see `image_number`.
    """
    x = positions(moment.bodies, moment.now)
    low, high = (np.array([getattr(own, end)(axis=0) for own in x]) for end in ("min", "max"))
    found: list[Near] = []
    obstacles = {id(pair.other): pair.other for pair in pairs if isinstance(pair.other, Obstacle)}
    beside_all = {key: _side(obstacle, moment) for key, obstacle in obstacles.items()}
    sides = [_Side(moment.bodies[index], index, at, moment.bodies[index].facets, None) for index, at in enumerate(x)]
    lengths = no_periods(x[0].shape[1]) if lengths is None else lengths
    for number, periods in _near_pairs(pairs, low, high, beside_all, lengths):
        pair, start = pairs[number], starts[number] + starts[-1] * image_number(periods)
        body, other = pair.body, pair.other
        own = sides[body]
        if isinstance(other, RigidWall):
            at = other.gaps(own.x)
            close = np.flatnonzero(at.gap < NEAR_BODY * float((high[body] - low[body]).max()))
            at = Gaps(at.gap[close], at.normal[close], close)
            found.append(_near(start + close, NO_EDGE, own, own.x[close], at, None, pair.friction, moment))
            continue
        beside, way = sides[other] if isinstance(other, int) else beside_all[id(other)], way_of(periods, lengths)
        for first, points, surface in (
            (start, own, beside.image(way)),
            (start + len(own.x), beside, own.image(-way)),
        ):
            found += _vertices_near(first, points, surface, pair.friction, moment, kept)
        if own.x.shape[1] == 3:
            found.append(_edges_near(start, own, beside.image(way), pair.friction, moment))
    return Near.joined(found, x[0].shape[1])


def image_number(periods: Sequence[int]) -> int:
    """One number for each image, zero for the surface itself."""
    return sum((k % IMAGES) * IMAGES**axis for axis, k in enumerate(periods))


def _near_pairs(
    pairs: Sequence[RigidPair], low: Array, high: Array, obstacles: Mapping[int, _Side], lengths: Array
) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Numbers of the pairs whose boxes are near each other, and the periods between them; obstacles: by their ids."""
    extents = (high - low).max(axis=1)
    both = np.array([(number, p.body, p.other) for number, p in enumerate(pairs) if isinstance(p.other, int)])
    apart = np.zeros(len(pairs), dtype=bool)
    if len(both):
        number, one, other = both.T
        margin = NEAR_BOXES * np.minimum(extents[one], extents[other])
        apart[number] = gap_of_boxes((low[one], high[one]), (low[other], high[other]), lengths) > margin
    here = (0,) * low.shape[1]
    for index in np.flatnonzero(~apart):
        wall, body = pairs[index].other, pairs[index].body
        box = low[body], high[body]
        if isinstance(wall, RigidWall):
            nearest = np.where(wall.normal > 0.0, *box)
            if (nearest - wall.at) @ wall.normal < NEAR_BODY * extents[body]:
                yield int(index), here
        elif isinstance(wall, Obstacle):
            side = obstacles[id(wall)]
            repeated = without_longer(side.x, lengths)
            for periods in ways_to(box, side.box, repeated, NEAR_BODY * float(extents[body])):
                yield int(index), periods
        else:
            margin = NEAR_BOXES * float(min(extents[body], extents[wall]))
            for periods in ways_to(box, (low[wall], high[wall]), lengths, margin):
                yield int(index), periods


def _side(obstacle: Obstacle, moment: Moment) -> _Side:
    here = obstacle.at(moment.t)
    rests = obstacle.motion is None or moment.dt <= 0.0
    return _Side(obstacle, -1, here, obstacle.facets, None if rests else here - obstacle.at(moment.t - moment.dt))


def _vertices_near(
    start: int, points: _Side, surface: _Side, friction: float, moment: Moment, kept: Near | None
) -> list[Near]:
    """The vertices of one side near the facets of the other one."""
    margin = NEAR_BODY * min(points.extent, surface.extent)
    low, high = surface.box[0] - margin, surface.box[1] + margin
    near = np.flatnonzero(((points.x >= low) & (points.x <= high)).all(axis=1))
    if len(near) == 0:
        return []
    x, corners = points.x[near], surface.x[surface.facets]
    low, high = x.min(axis=0) - margin, x.max(axis=0) + margin
    facing = np.flatnonzero(((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1))
    if len(facing) == 0:
        return []
    at = gaps(x, corners[facing], points.outward[near], margin)
    close = at.gap < margin
    if not close.any():
        return []
    near, at = near[close], Gaps(at.gap[close], at.normal[close], facing[at.facet[close]])
    if kept is not None:
        _keep(at, start + near, points.x[near], surface, kept)
    given = None if points.moved is None else points.moved[near]
    return [_near(start + near, NO_EDGE, points, points.x[near], at, surface, friction, moment, given)]


def _keep(at: Gaps, vertex: NDArray[np.int64], x: Array, surface: _Side, kept: Near) -> None:
    """Let vertices that `kept` has face the planes of their facets there."""
    kept = kept[kept.edge < 0]
    _, here, there = np.intersect1d(vertex, kept.vertex, return_indices=True)
    corners = surface.x[surface.facets[kept.facet[there]]]
    at.normal[here], at.facet[here] = unit_normals(corners), kept.facet[there]
    at.gap[here] = np.einsum("nd,nd->n", x[here] - corners[:, 0], at.normal[here])


def _edges_near(start: int, points: _Side, surface: _Side, friction: float, moment: Moment) -> Near:
    """The points of a body where its edges cross those of another surface."""
    size = min(points.extent, surface.extent)
    margin = NEAR_BOXES * size
    found = crossings(points.edges_near(surface, margin), surface.edges_near(points, margin), margin, NEAR_BODY * size)
    if (found.gap < -FAR_BEHIND * size).any():
        found = found[_apart_before(found, points, surface, moment) > -FAR_BEHIND * size]
    edge = found.one.number * len(surface.of.edges.ends) + found.other.number
    at = Gaps(found.gap, found.normal, surface.of.edges.facets[found.other.number, 0])
    vertex = start + points.of.edges.ends[found.one.number, 0]
    near = _near(vertex, edge, points, found.at, at, surface, friction, moment)
    return replace(near, along=np.stack([found.one.along, found.other.along], axis=1))


def _apart_before(found: Crossings, points: _Side, surface: _Side, moment: Moment) -> Array:
    """Gaps [m] of the lines of edges at the start of the step."""
    ends = []
    for placed, side in ((found.one, points), (found.other, surface)):
        facets = side.of.edges.facets[placed.number, 0]
        last = placed.first + placed.length[:, None] * placed.along
        ends.append((side.before(placed.first, facets, moment), side.before(last, facets, moment)))
    return gaps_of_lines(ends[0], ends[1], found.normal)


def _near(
    vertex: NDArray[np.int64],
    edge: NDArray[np.int64],
    points: _Side,
    x: Array,
    at: Gaps,
    surface: _Side | None,
    friction: float,
    moment: Moment,
    given: Array | None = None,
) -> Near:
    """Points x [m] of a body, or of an obstacle that has moved by `given` [m] in the step."""
    foot = x - at.gap[:, None] * at.normal
    given = np.zeros_like(x) if given is None else given.copy()
    if surface is not None and surface.moved is not None:
        given -= _moved_below(foot, surface, at.facet)
    carried = given.copy()
    if points.body >= 0:
        carried += moment.carried(points.body, x)
    way = np.zeros_like(x) if surface is None or surface.way is None else np.tile(surface.way, (len(x), 1))
    if surface is not None and surface.body >= 0:
        carried -= moment.carried(surface.body, foot - way)
    body = np.tile([points.body, -1 if surface is None else surface.body], (len(x), 1))
    friction_of = np.full(len(x), friction)
    edge = np.broadcast_to(edge, len(x))
    along = np.zeros((len(x), 2, x.shape[1]))
    return Near(vertex, edge, body, way, at.gap, _frames(at.normal), x, carried, given, friction_of, at.facet, along)


def _frames(normals: Array) -> Array:
    """Orthonormal frames, shape (m, dim, dim), whose first vectors are the normals."""
    if normals.shape[1] == 2:
        return np.stack([normals, np.stack([-normals[:, 1], normals[:, 0]], axis=1)], axis=1)
    axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, axis)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([normals, first, np.cross(normals, first)], axis=1)


def _moved_below(feet: Array, surface: _Side, facets: NDArray[np.int64]) -> Array:
    """Displacements in the step [m] of the points of an obstacle's facets at the feet, shape (n, dim)."""
    assert surface.moved is not None
    corners, v = surface.x[surface.facets[facets]], surface.moved[surface.facets[facets]]
    edges = corners[:, 1:] - corners[:, :1]
    shares = np.einsum("nd,nde->ne", feet - corners[:, 0], np.linalg.pinv(edges))
    return v[:, 0] + np.einsum("ne,ned->nd", shares, v[:, 1:] - v[:, :1])
