"""The sentinel of bodies that overlap: moved into each other at the end of a step, or through each other within one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, FailureKind, Finding, State
from solvers.mesh.penetration import depths, inside
from solvers.mesh.periods import box_of, gap_of_boxes, no_periods, way_of, ways_to, without_longer
from solvers.mesh.search import Search
from solvers.sentinels.bodies import LEFT_BETWEEN, Measures, MovingBody, arc_height

#: Samples per edge of a facet at most: of a facet larger than so many thicknesses of the other body.
MOST_SAMPLES = 64

#: Share of the thickness of the thinner body, or the edge of a facet if that is less, from which depth on an overlap
#: means nothing. A body that passes through a plate has points in its middle, one half of the thickness deep; states
#: within a step are half a thickness apart, so that one of them has a point deeper than a quarter.
TOO_DEEP = 0.25

Depth = tuple[float, tuple[float, ...], float]  #: depth [m], the point [m], depth from which on it means nothing [m]
#: Nothing overlaps.
NOT_AT_ALL: Depth = (0.0, (), 0.0)


@dataclass(frozen=True)
class Meeting:
    """A pair of bodies between which contact is computed."""

    pairs: tuple[str, ...]  #: names of pairs
    slave: str  #: name of the slave's body
    facets: Mapping[str, NDArray[np.bool_]]  #: body -> facets on surfaces of a pair; absent: all


@dataclass(frozen=True)
class Samples:
    """Points on the facets of one body that are looked for in another one."""

    facet: NDArray[np.int64]  #: (k,)
    weights: Array  #: of the corners of the facet, (k, dim)
    paired: NDArray[np.bool_]  #: points on surfaces of a pair
    vertex: NDArray[np.int64]  #: number of the vertex that a point is, else a number of its own

    def on(self, facets: NDArray[np.int64]) -> NDArray[np.int64]:
        """Those on some facets, each vertex once."""
        if len(facets) < self.facet.max() + 1:
            chosen = np.flatnonzero(np.isin(self.facet, facets))
        else:
            chosen = np.arange(len(self.facet))
        return chosen[np.unique(self.vertex[chosen], return_index=True)[1]]

    def at(self, chosen: NDArray[np.int64], corners: Array) -> Array:
        """Positions [m] of some of them, for corners (m, dim, dim) of the facets."""
        return np.einsum("kv,kvd->kd", self.weights[chosen], corners[self.facet[chosen]])


class Overlaps:
    """Looks for points of the surface of one body in another one, unless both are rigid with a prescribed motion.

    What was in the other body at the start may stay there, except on surfaces of a pair; without a pair, bodies that
    overlap at the start are meant to, and what they do later is a finding but not worthless. Facets replace arcs: a
    point counts from the depth on that exceeds the height of the arcs of both facets. In contact, the gap is zero in
    the mean over a facet of the slave, so there the arcs are those of both surfaces over such a facet, edges included.
    """

    def __init__(
        self,
        bodies: Sequence[MovingBody],
        meetings: Mapping[frozenset[str], Meeting],
        tied: set[frozenset[str]],
        periods: Array | None = None,
    ):
        """meetings: by the names of both bodies; tied: bodies that are tied to each other.

        periods: lengths [m] after which space repeats, see `solvers.mesh.periods`; None: it does not.
        """
        self._periods = periods
        self._bodies, self._meetings = list(bodies), dict(meetings)
        self._pairs = [
            (i, j)
            for i, j in combinations(range(len(bodies)), 2)
            if (bodies[i].free or bodies[j].free) and frozenset((bodies[i].name, bodies[j].name)) not in tied
        ]
        self._samples: dict[tuple[int, int], Samples] = {}
        self._start: list[Array] = []  # positions [m] at the start
        self._before: list[Array] = []  # positions [m] at the end of the last step
        self._time = 0.0  # of these [s]
        self._measures: dict[int, Measures] = {}
        self._searches = {(i, j): Search(bodies[i].facets, bodies[j].facets) for i, j in self._pairs}

    def start(self, t: float) -> None:
        """Keep the positions and what overlaps at the time t [s]."""
        self._before, self._time = self._positions(t), t
        corners = [x[body.facets] for body, x in zip(self._bodies, self._before, strict=True)]
        parts = enumerate(zip(self._bodies, corners, strict=True))
        self._measures = {k: Measures(body.facets, own) for k, (body, own) in parts}
        self._samples.clear()
        self._start = self._before

    def _positions(self, t: float) -> list[Array]:
        return [body.positions(t) for body in self._bodies]

    def look(self, t: float, dt: float) -> list[Finding]:
        """Overlaps at the end t [s] of a step, and passages within it."""
        now, before = self._positions(t), self._before
        overlapping: dict[tuple[int, int], Finding] = {}
        for i, j, way in self._near(now, now):
            if (i, j) not in overlapping and (finding := self._overlap(i, j, _with_image(now, j, way))):
                overlapping[i, j] = finding
        passed = [
            self._passage(i, j, _with_image(before, j, way), _with_image(now, j, way))
            for i, j, way in self._near(before, now)
            if (i, j) not in overlapping
        ]
        self._before, self._time = now, t
        return [*overlapping.values(), *(finding for finding in passed if finding)]

    def _near(self, before: Sequence[Array], now: Sequence[Array]) -> Iterator[tuple[int, int, Array]]:
        """Pairs of bodies whose boxes over the step overlap, and the way [m] of the second one's image that is met."""
        if not self._pairs:
            return
        low = np.array([np.minimum(a.min(axis=0), b.min(axis=0)) for a, b in zip(before, now, strict=True)])
        high = np.array([np.maximum(a.max(axis=0), b.max(axis=0)) for a, b in zip(before, now, strict=True)])
        i, j = np.array(self._pairs).T
        if self._periods is None:
            near = ((low[i] < high[j]) & (low[j] < high[i])).all(axis=1)
            yield from ((*self._pairs[k], np.zeros(low.shape[1])) for k in np.flatnonzero(near))
            return
        near = gap_of_boxes((low[i], high[i]), (low[j], high[j]), self._periods) < 0.0
        for one, other in (self._pairs[k] for k in np.flatnonzero(near)):
            for way in self._ways((low[one], high[one]), (low[other], high[other])):
                yield one, other, way

    def _ways(self, one: tuple[Array, Array], other: tuple[Array, Array]) -> Iterator[Array]:
        """Ways [m] to the images whose boxes overlap that of the first one; a body longer than a period has none."""
        lengths = no_periods(len(one[0])) if self._periods is None else self._periods
        lengths = without_longer(np.stack(other), lengths)
        yield from (way_of(periods, lengths) for periods in ways_to(one, other, lengths))

    # ------------------------------------------------------------------------------------------------------ overlaps

    def _overlap(self, i: int, j: int, now: Sequence[Array]) -> Finding | None:
        depth, where, limit = self._deepest(i, j, now)
        if depth == 0.0:
            return None
        meeting = self._meeting(i, j)
        worthless = depth > limit and (meeting is not None or not self._at_start(i, j))
        names, place = self._names(i, j), place_of(where)
        message = f"{names} overlap by {depth:.3g} {place}: "
        if meeting is None and self._bodies[i].rigid and self._bodies[j].rigid:
            message += "rigid bodies that overlap have no contact; move one of them, or take a smaller 'step'"
        elif meeting is None:
            message += "no pair of contact names them, so nothing holds them apart; give them a pair"
        else:
            message += f"contact ({', '.join(meeting.pairs)}) does not hold them apart; take a smaller 'step' or a "
            message += "finer slave surface, and begin without overlap"
        kind = FailureKind.NOT_HELD if meeting is None else FailureKind.PASSAGE
        return Finding("overlap", names, depth, message, kind if worthless else None, where)

    def _deepest(self, i: int, j: int, x: Sequence[Array]) -> Depth:
        """The deepest point of one body in the other, where their surfaces cross."""
        meet = self._searches[i, j].pairs(x[i], x[j], 0.0)
        if not len(meet):
            return NOT_AT_ALL
        near = {i: np.unique(meet[:, 0]), j: np.unique(meet[:, 1])}
        if all(self._deep(a, b, x, near[a], near[b], whole=False)[0] == 0.0 for a, b in ((i, j), (j, i))):
            return NOT_AT_ALL
        return max((self._deep(a, b, x, near[a], near[b]) for a, b in ((i, j), (j, i))), key=lambda one: one[0])

    def overlapping(self) -> Iterator[tuple[str, str, float]]:
        """(name, name, depth [m]) of bodies that overlap at the start, also where one is whole in the other."""
        for i, j in dict.fromkeys((i, j) for i, j, _ in self._near(self._start, self._start)):
            if (depth := self._at_start(i, j)) > 0.0:
                yield self._bodies[i].name, self._bodies[j].name, depth

    def _at_start(self, i: int, j: int) -> float:
        """Depth [m] by which two bodies overlap at the start."""
        every = {k: np.arange(len(self._bodies[k].facets)) for k in (i, j)}
        images = [_with_image(self._start, j, way) for way in self._ways(*(box_of(self._start[k]) for k in (i, j)))]
        ways = product(((i, j), (j, i)), images)
        found = [self._deep(a, b, x, every[a], every[b], at_start=True) for (a, b), x in ways]
        return max(found, default=NOT_AT_ALL)[0]

    def _deep(
        self,
        a: int,
        b: int,
        x: Sequence[Array],
        mine_near: NDArray[np.int64],
        near: NDArray[np.int64],
        *,
        whole: bool = True,
        at_start: bool = False,
    ) -> Depth:
        """The deepest point of body a in body b; mine_near, near: facets of a and b where the surfaces cross.

        whole: points on all facets of a count, not only on these; at_start: also what was in body b at the start.
        """
        facets = np.arange(len(self._bodies[a].facets)) if whole else mine_near
        mine, other = x[a][self._bodies[a].facets], x[b][self._bodies[b].facets]
        samples = self._samples_of(a, b)
        chosen = samples.on(facets)
        points = samples.at(chosen, mine)
        solid = ((points > x[b].min(axis=0)) & (points < x[b].max(axis=0))).all(axis=1)
        solid[solid] = inside(points[solid], other)
        chosen, points = chosen[solid], points[solid]
        if not len(points):
            return NOT_AT_ALL
        facet = samples.facet[chosen]
        near_both = mine_near, near
        tolerance = self._tolerance(a, b, facet, near_both, self._measures)
        depth = depths(points, other, tolerance)
        if depth.any():  # what bodies have bent since the start counts, too
            present = {k: Measures(self._bodies[k].facets, x[k][self._bodies[k].facets]) for k in (a, b)}
            tolerance = np.maximum(tolerance, self._tolerance(a, b, facet, near_both, present))
            depth[depth <= tolerance] = 0.0
        if not at_start:
            deep = np.flatnonzero(depth)
            first = samples.at(chosen[deep], self._start[a][self._bodies[a].facets])
            began = np.zeros(len(deep), dtype=bool)
            for way in self._ways(*(box_of(self._start[k]) for k in (a, b))):
                began |= inside(first, (self._start[b] + way)[self._bodies[b].facets])
            depth[deep[began & ~samples.paired[chosen[deep]]]] = 0.0
        k = int(depth.argmax())
        edge = min(self._measures[a].edge[facet[k]], self._measures[b].edge[near].min())
        limit = min(float(edge), TOO_DEEP * min(self._measures[k].thickness for k in (a, b)))
        if self._meeting(a, b) is not None:
            limit += float(tolerance[k])
        return float(depth[k]), tuple(points[k].tolist()), limit

    def _tolerance(
        self,
        a: int,
        b: int,
        facet: NDArray[np.int64],
        near: tuple[NDArray[np.int64], NDArray[np.int64]],
        measures: Mapping[int, Measures],
    ) -> Array:
        """Depth [m] up to which points on facets of body a are on the surface of body b; near: facets of a and b."""
        mine, other = measures[a], measures[b]
        thickness = min(mine.thickness, other.thickness)
        meeting = self._meeting(a, b)
        if meeting is None:
            return LEFT_BETWEEN * thickness + mine.sagitta[facet] + other.sagitta[near[1]].max()
        slave, there = (a, near[0]) if meeting.slave == self._bodies[a].name else (b, near[1])
        chord = self._bodies[slave].pieces * float(measures[slave].edge[there].max())
        turn = sum(
            chord * one.curvature[some].max() + one.bends[1][some].max()
            for one, some in ((mine, near[0]), (other, near[1]))
        )
        arc = float(arc_height(np.array(chord), np.array(turn)))
        return np.full(len(facet), LEFT_BETWEEN * thickness + min(arc, 0.5 * thickness))

    def _samples_of(self, a: int, b: int) -> Samples:
        """Points on facets of body a, not farther apart than body b is thick."""
        if (a, b) not in self._samples:
            facet, weights = lattice(
                self._measures[a].edge / self._measures[b].thickness, self._bodies[a].facets.shape[1]
            )
            whole = weights.max(axis=1) == 1.0
            vertex = -1 - np.arange(len(facet))
            vertex[whole] = self._bodies[a].facets[facet[whole], weights[whole].argmax(axis=1)]
            paired = np.zeros(len(facet), dtype=bool)
            if (meeting := self._meeting(a, b)) is not None:
                on_pair = meeting.facets.get(self._bodies[a].name)
                paired = np.ones_like(paired) if on_pair is None else on_pair[facet]
            self._samples[a, b] = Samples(facet, weights, paired, vertex)
        return self._samples[a, b]

    # ------------------------------------------------------------------------------------------------------ passages

    def _passage(self, i: int, j: int, before: Sequence[Array], now: Sequence[Array]) -> Finding | None:
        """Bodies that pass through each other between two states without overlap, on straight ways."""
        moved = [float(np.linalg.norm(now[k] - before[k], axis=1).max()) for k in (i, j)]
        thickness = min(self._measures[k].thickness for k in (i, j))
        count = int(np.ceil(0.5 * sum(moved) / (TOO_DEEP * thickness)))
        if count < 2:
            return None
        if not len(self._searches[i, j].pairs(now[i], now[j], 0.0, before[i], before[j])):
            return None
        shares = np.arange(1, count) / count
        low, high = (
            [(1.0 - shares)[:, None] * end(before[k], axis=0) + shares[:, None] * end(now[k], axis=0) for k in (i, j)]
            for end in (np.min, np.max)
        )
        met = ((low[0] < high[1]) & (low[1] < high[0])).all(axis=1)
        for share in shares[met]:
            x = [np.empty(0)] * len(now)
            for k in (i, j):
                x[k] = (1.0 - share) * before[k] + share * now[k]
            depth, where, limit = self._deepest(i, j, x)
            if depth > limit and self._deepest(i, j, before)[0] == 0.0:
                names = self._names(i, j)
                message = f"{names} pass through each other within the step {place_of(where)}; take a smaller 'step'"
                return Finding("passage", names, sum(moved), message, FailureKind.PASSAGE, where)
        return None

    def _meeting(self, a: int, b: int) -> Meeting | None:
        return self._meetings.get(frozenset((self._bodies[a].name, self._bodies[b].name)))

    def _names(self, i: int, j: int) -> str:
        return f"{self._bodies[i].name} and {self._bodies[j].name}"

    # ---------------------------------------------------------------------------------------------------------- state

    def save(self) -> State:
        return {"time": self._time}

    def restore(self, state: State) -> None:
        """Continue with bodies that have been restored already."""
        self._time = state["time"]
        self._before = self._positions(self._time)


def _with_image(x: Sequence[Array], body: int, way: Array) -> list[Array]:
    """Positions [m] of all bodies, with those of an image of one of them."""
    return [own + way if index == body and way.any() else own for index, own in enumerate(x)]


def lattice(sizes: Array, corners: int) -> tuple[NDArray[np.int64], Array]:
    """(facet, weights of its corners) of points on facets with ceil(size) intervals on each edge."""
    counts = np.clip(np.ceil(sizes), 1, MOST_SAMPLES).astype(np.int64)
    facets, weights = [], []
    for count in np.unique(counts).tolist():
        if corners == 2:
            first = np.arange(count) / count  # the other end belongs to the next facet
            own = np.stack([1.0 - first, first], axis=1)
        else:
            i, j = np.nonzero(np.add.outer(np.arange(count + 1), np.arange(count + 1)) <= count)
            own = np.stack([i, j, count - i - j], axis=1) / count
        chosen = np.flatnonzero(counts == count)
        facets.append(np.repeat(chosen, len(own)))
        weights.append(np.tile(own, (len(chosen), 1)))
    return np.concatenate(facets), np.concatenate(weights)


def place_of(where: Sequence[float]) -> str:
    """A place in a message."""
    return "at (" + ", ".join(f"{c:.4g}" for c in where) + ")"
