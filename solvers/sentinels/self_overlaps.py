"""The sentinel of bodies that overlap themselves: at the end of a step, or as they pass through themselves within it.

The surface of a body encloses each point of it once. Where the body overlaps itself, it encloses points twice. Points
are looked for below facets that come together, by half of the depth up to which contact and arcs let them lie in each
other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from solvers.api import Array, FailureKind, Finding, Indices, State
from solvers.mesh.penetration import depths, windings
from solvers.mesh.search import OPPOSED, Search
from solvers.mesh.tessellation import unit_normals
from solvers.sentinels.bodies import LEFT_BETWEEN, Measures, MovingBody, arc_height
from solvers.sentinels.overlaps import TOO_DEEP, lattice, place_of

#: Distance in thicknesses within which parts of a surface are looked for. If there are none, it is looked for them anew
#: when a vertex has moved by half of it, but for a rigid motion.
REACH = 0.5

#: Depth in thicknesses from which on facets behind each other are the two sides of a wall.
WALL = 0.5

#: How far points on facets are moved towards the middles: those on edges are on two facets.
TO_MIDDLE = 0.1


#: By how much nearer a point below a facet may be to the facets beside it, where the surface bends.
BENT = 0.1


@dataclass
class FoldingBody:
    """One body and what is known of it."""

    body: MovingBody
    pairs: tuple[str, ...]  #: contact of its surface with itself
    measures: Measures
    first: Array  #: positions [m] of the vertices at the start
    before: Array  #: the same at the end of the last step
    clear: Array | None = None  #: positions [m] of the latest state in which nothing was near
    search: Search | None = None


class SelfOverlaps:
    """Looks for overlaps of elastic bodies with themselves.

    Where a pair of contact is to hold a body apart, states in which it does not are repeated.
    """

    def __init__(self, bodies: Sequence[MovingBody], pairs: Mapping[str, tuple[str, ...]]):
        """pairs: names of the pairs of contact between surfaces of one body, by its name."""
        self._bodies, self._pairs = list(bodies), dict(pairs)
        self._watched: list[FoldingBody] = []
        self._time = 0.0

    def start(self, t: float) -> None:
        """Keep the positions at the time t [s]."""
        self._time, self._watched = t, []
        for body in self._bodies:
            x = body.positions(t)
            pairs, measures = self._pairs.get(body.name, ()), Measures(body.facets, x[body.facets])
            self._watched.append(FoldingBody(body, pairs, measures, x, x))

    def look(self, t: float, dt: float) -> list[Finding]:
        """Overlaps at the end t [s] of a step, and passages within it."""
        found = [finding for one in self._watched if (finding := _look(one, one.body.positions(t)))]
        self._time = t
        return found

    def save(self) -> State:
        return {"time": self._time}

    def restore(self, state: State) -> None:
        """Continue with bodies that have been restored already."""
        self._time = state["time"]
        for one in self._watched:
            one.before = one.body.positions(self._time)


def _look(one: FoldingBody, now: Array) -> Finding | None:
    before, one.before = one.before, now
    thickness = one.measures.thickness
    reach = REACH * thickness
    if one.clear is not None and _is_close(one.clear, now, 0.5 * reach):
        return None
    middle, turned = now.mean(axis=0), _turned(before, now)
    here = now - middle
    near = _opposite(one, here, turned, reach)
    one.clear = None if len(near) else now
    swept = _opposite(one, here, turned, 0.0) if len(near) else near
    return _in_states(one, turned, here, middle, np.unique(swept)) if len(swept) else None


def _in_states(one: FoldingBody, before: Array, now: Array, middle: Array, facets: Indices) -> Finding | None:
    """The finding of the end of a step or of states within it; positions [m] are relative to their middle."""
    thickness = one.measures.thickness_at(facets)
    arcs = min(_tolerance(one, now, facets), 0.5 * thickness)
    deep = arcs + min(float(one.measures.edge[facets].min()), TOO_DEEP * thickness)
    name = one.body.name
    if (where := _enclosed_twice(one, now, facets, arcs, thickness)) is not None:
        worthless = _enclosed_twice(one, now, facets, deep, thickness) is not None
        depth, place = deep if worthless else arcs, place_of((where + middle).tolist())
        message = f"{name} overlaps itself by more than {depth:.3g} {place}: "
        if one.pairs:
            names = ", ".join(one.pairs)
            message += f"contact ({names}) does not hold it apart; take a smaller 'step' or a finer surface"
        else:
            message += "no pair of contact names its surface, so nothing holds it apart; give it a pair 'self'"
        kind = FailureKind.PASSAGE if one.pairs else FailureKind.NOT_HELD
        return Finding("overlap", name, depth, message, kind if worthless else None, tuple((where + middle).tolist()))
    way = float(np.linalg.norm(now - before, axis=1).max())
    count = int(np.ceil(2.0 * way / (TOO_DEEP * thickness)))  # parts move by a quarter of the thickness to each other
    for share in np.arange(1, count) / count:
        x = (1.0 - share) * before + share * now
        if (where := _enclosed_twice(one, x, facets, deep, thickness)) is None:
            continue
        if _enclosed_twice(one, before, facets, deep, thickness) is not None:
            return None  # it was so before the step
        message = (
            f"{name} passes through itself within the step {place_of((where + middle).tolist())}; take a smaller 'step'"
        )
        return Finding("passage", name, way, message, FailureKind.PASSAGE, tuple((where + middle).tolist()))
    return None


def _opposite(one: FoldingBody, now: Array, before: Array, reach: float) -> Indices:
    """Pairs (p, 2) of facets that face each other and come so close [m] in a step; not the two sides of walls."""
    facets = one.body.facets
    if one.search is None:
        one.search = Search(facets, facets)
    i, j = one.search.pairs(now, now, reach, before, before).astype(np.int64).T
    i, j = i[i < j], j[i < j]
    normals = unit_normals(now[facets]), unit_normals(before[facets])
    opposed = np.logical_or.reduce([np.einsum("pd,pd->p", n.take(i, 0), n.take(j, 0)) < OPPOSED for n in normals])
    i, j = i[opposed], j[opposed]
    middles = before[facets].mean(axis=1)
    behind = -0.5 * np.einsum("pd,pd->p", middles[j] - middles[i], normals[1][i] - normals[1][j])
    walls = behind >= WALL * one.measures.thickness
    neighbours = (facets[i][:, :, None] == facets[j][:, None]).any(axis=(1, 2))
    return np.stack([i, j], axis=1)[~walls & ~neighbours]


def _tolerance(one: FoldingBody, x: Array, facets: Indices) -> float:
    """Depth [m] up to which parts of a surface may lie in each other: the arcs that facets replace."""
    found = 0.0
    for measures in (one.measures, Measures(one.body.facets, x[one.body.facets])):
        chord = one.body.pieces * float(measures.edge[facets].max())
        turn = 2.0 * chord * float(measures.curvature[facets].max())
        if one.pairs:
            turn += 2.0 * float(measures.bends[1][facets].max())
        found = max(found, float(arc_height(np.array(chord), np.array(turn))))
    return LEFT_BETWEEN * one.measures.thickness + found


def _enclosed_twice(one: FoldingBody, x: Array, facets: Indices, depth: float, apart: float) -> Array | None:
    """A point [m] that the surface encloses twice, where parts of a body lie so deep [m] in each other, None without.

    It is in the middle of both surfaces, half of the depth below each. apart: distance [m] of points on large facets.
    """
    corners = x[one.body.facets]
    mine = corners[facets]
    number, weights = lattice(one.measures.edge[facets] / apart, x.shape[1])
    weights = (1.0 - TO_MIDDLE) * weights + TO_MIDDLE / x.shape[1]
    half = 0.5 * depth
    points = _below(mine, number, weights, half)
    twice = np.flatnonzero(windings(points, corners) > 1.5)
    away = np.full(len(twice), (1.0 - BENT) * half)
    twice = twice[depths(points[twice], corners, away) > 0.0]
    if len(twice) and not one.pairs:  # what overlapped at the start may do so
        first = one.first[one.body.facets]
        began = _below(first[facets], number[twice], weights[twice], half)
        twice = twice[windings(began, first) < 1.5]
    return points[twice[0]] if len(twice) else None


def _below(corners: Array, number: Indices, weights: Array, depth: float) -> Array:
    """Points [m] so deep [m] below those with these weights on facets."""
    return np.einsum("kv,kvd->kd", weights, corners[number]) - depth * unit_normals(corners)[number]


def _is_close(first: Array, second: Array, limit: float) -> bool:
    """Whether no vertex has moved by the limit [m] between two states, but for the rigid motion between them."""
    away = second - first
    if np.abs(away - away[0]).max() < 0.5 * limit / first.shape[1]:  # a translation
        return True
    return bool(np.linalg.norm(_turned(first, second) - (second - second.mean(axis=0)), axis=1).max() < limit)


def _turned(first: Array, second: Array) -> Array:
    """Positions [m] of the first state about its middle, turned towards those of the second one (Kabsch)."""
    a, b = first - first.mean(axis=0), second - second.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = np.eye(len(u))
    turn[-1, -1] = np.sign(np.linalg.det(u @ vt))
    return np.asarray(a @ u @ turn @ vt)
