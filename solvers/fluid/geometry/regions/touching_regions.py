"""Regions of the fluid in a cell, in 2D, where surfaces touch, cross or overlap: the cell without the union of solids.

They are the faces of the planar graph of chords and wet perimeter (de Berg and others, Computational Geometry, Springer
2008, chapter 2; docs/theory_fluid.md, Bodies that touch or overlap).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.geometry.pieces import FLUSH, NOTHING
from solvers.fluid.geometry.regions.regions import (
    CORNERS_OF_SQUARE,
    SAME_POINT,
    Chord,
    Region,
    area_of,
    on_perimeter,
    wet_faces,
)

#: Gap, relative to a cell, up to which surfaces touch: there is no fluid between them. As with the box's boundary.
TOUCHING = FLUSH
#: Decimals of points, relative to a cell, without their rounding errors.
DECIMALS = 12
#: The same as a length.
LEAST_LENGTH = 10.0**-DECIMALS


def meet(chords: Sequence[Chord], body: NDArray[np.int64]) -> bool:
    """Whether chords of two bodies cross, or a corner or an end of one touches the other; body: of each facet."""
    for (one, of), (other, of_other) in combinations(chords, 2):
        if body[of[0]] != body[of_other[0]] and _touch(one, other):
            return True
    return False


def _touch(one: Array, other: Array) -> bool:
    """Whether two chords cross, or a corner or an end of one touches the other."""
    if (one.min(axis=0) > other.max(axis=0) + TOUCHING).any() or (other.min(axis=0) > one.max(axis=0) + TOUCHING).any():
        return False
    return len(_crossings(one, other)[0]) + len(_near(one, other)[0]) + len(_near(other, one)[0]) > 0


def touching_regions(cell: int, solid: float, chords: Sequence[Chord]) -> list[Region] | None:
    """Regions of the fluid in a cell; None if their boundaries do not close.

    solid: share of solid in the cell, where bodies overlap counted as often as there are bodies.
    """
    if np.isnan([on_perimeter(line[end]) for line, _ in chords for end in (0, -1)]).any():
        return None
    chords = [_rounded(*chord) for chord in chords]
    wet = _wet(solid, chords)
    if not wet(np.concatenate([_beside(line[:-1], line[1:]) for line, _ in chords])).any() and not any(
        _touch(one, other) for (one, _), (other, _) in combinations(chords, 2)
    ):
        return []  # surfaces that do not meet have the solid on both sides as a whole
    ends, facets = _divided(chords)
    _, single = np.unique(ends.round(DECIMALS).reshape(-1, 4), axis=0, return_index=True)  # bodies with common sides
    ends, facets = ends[np.sort(single)], facets[np.sort(single)]
    open_side = wet(_beside(ends[:, 0], ends[:, 1]))
    ends, facets = ends[open_side][:, ::-1], facets[open_side]  # with the fluid on the left
    round_it = _perimeter_between(np.concatenate([*(line[[0, -1]] for line, _ in chords), ends.reshape(-1, 2)]))
    inward = round_it[:, 1] - round_it[:, 0]
    inward = np.stack([-inward[:, 1], inward[:, 0]], axis=1) / np.linalg.norm(inward, axis=1)[:, None]
    covered = (np.abs(round_it[:, None] - ends).max(axis=(2, 3)) < 2.0 * TOUCHING).any(axis=1)  # surface in a face
    round_it = round_it[wet(round_it.mean(axis=1) + TOUCHING * inward) & ~covered]
    ends = np.concatenate([ends, round_it])
    facets = np.concatenate([facets, np.full(len(round_it), -1)])
    loops = _loops(ends)
    if loops is None:
        return None
    found = []
    for loop in loops:
        polygon, of = ends[loop, 0], facets[loop]
        if (area := area_of(polygon)) < -SAME_POINT:
            return None
        if area > NOTHING**2:
            faces = [face for edge in ends[loop][of < 0] for face in _faces(*edge)]
            surface = np.concatenate([of[of >= 0, None], ends[loop][of >= 0].reshape(-1, 4)], axis=1)
            found.append(Region(cell, area, tuple(faces), frozenset(of[of >= 0].tolist()), polygon, surface))
    return found


def _rounded(line: Array, of: Sequence[int]) -> Chord:
    """The chord with points on the perimeter that are beside it by rounding, without segments of no length."""
    line = np.where(np.abs(line - line.round()) < LEAST_LENGTH, line.round(), line)
    long = np.abs(np.diff(line, axis=0)).max(axis=1) > 0.0
    return line[np.concatenate([[True], long])], [facet for facet, kept in zip(of, long, strict=True) if kept]


def _beside(begin: Array, end: Array) -> Array:
    """Points beside the middles of segments, out of the solid."""
    along = end - begin
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    return np.asarray(0.5 * (begin + end) + TOUCHING * outward)


def _wet(solid: float, chords: Sequence[Chord]) -> Callable[[Array], NDArray[np.bool_]]:
    """Whether points are in no body."""
    polygons = [_solid_polygon(line) for line, _ in chords]
    around = round(solid - sum(area_of(polygon) for polygon in polygons))

    def wet(x: Array) -> NDArray[np.bool_]:
        found: NDArray[np.bool_] = around + np.sum([_inside(polygon, x) for polygon in polygons], axis=0) == 0
        return found

    return wet


def _solid_polygon(line: Array) -> Array:
    """The part of the cell on the left of a chord."""
    begin, end = on_perimeter(line[-1]), on_perimeter(line[0])
    end += 4.0 * (end < begin)
    corners = [CORNERS_OF_SQUARE[k % 4] for k in range(int(np.floor(begin)) + 1, int(np.ceil(end)))]
    return np.array([*line, *corners])


def _inside(polygon: Array, x: Array) -> NDArray[np.bool_]:
    """Whether points are in a polygon: a ray from them crosses it an odd number of times."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    above = (a[:, 1] > x[:, None, 1]) != (b[:, 1] > x[:, None, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        at = a[:, 0] + (x[:, None, 1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return np.asarray((above & (x[:, None, 0] < at)).sum(axis=1) % 2 == 1)


def _crossings(one: Array, other: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """(segment of one line, segment of the other, point) where they cross."""
    p, r = one[:-1, None], np.diff(one, axis=0)[:, None]
    q, s = other[None, :-1], np.diff(other, axis=0)[None]
    across = r[..., 0] * s[..., 1] - r[..., 1] * s[..., 0]
    way = q - p
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (way[..., 0] * s[..., 1] - way[..., 1] * s[..., 0]) / across
        u = (way[..., 0] * r[..., 1] - way[..., 1] * r[..., 0]) / across
    i, j = np.nonzero((t >= 0.0) & (t <= 1.0) & (u >= 0.0) & (u <= 1.0))
    return i, j, one[i] + t[i, j, None] * r[i, 0]


def _near(one: Array, other: Array) -> tuple[NDArray[np.int64], Array]:
    """(segment of one line, corner or end of the other) that touch."""
    a, along = one[:-1, None], np.diff(one, axis=0)[:, None]
    t = np.clip(((other - a) * along).sum(axis=2) / (along**2).sum(axis=2), 0.0, 1.0)
    i, j = np.nonzero(np.linalg.norm(a + t[..., None] * along - other, axis=2) < TOUCHING)
    return i, other[j]


def _divided(chords: Sequence[Chord]) -> tuple[Array, NDArray[np.int64]]:
    """(ends of the parts into which chords are divided where they meet, facet of each)."""
    ends, facets = [], []
    for k, (line, of) in enumerate(chords):
        points: list[list[Array]] = [[] for _ in of]
        for m, (other, _) in enumerate(chords):
            if m != k:
                segment, _, x = _crossings(line, other)
                close, corner = _near(line, other)
                for i, point in zip([*segment, *close], [*x, *corner], strict=True):
                    points[i].append(point)
        for i, facet in enumerate(of):
            a, b = line[i], line[i + 1]
            along = [float((x - a) @ (b - a)) for x in points[i]]
            stops = [a, *(points[i][n] for n in np.argsort(along)), b]
            for begin, end in pairwise(stops):
                ends.append([begin, end])
                facets.append(facet)
    merged = _merged(np.array(ends))
    length = np.linalg.norm(merged[:, 1] - merged[:, 0], axis=1)
    return merged[length > 0.0], np.array(facets, dtype=np.int64)[length > 0.0]


def _merged(ends: Array) -> Array:
    """The same parts, with points that touch made one; points on the perimeter stay there."""
    points = ends.reshape(-1, 2)
    off = np.minimum(points, 1.0 - points).min(axis=1)
    order = np.argsort(off, kind="stable")
    merged = points.copy()
    left = np.ones(len(points), dtype=bool)
    for k in order:
        if left[k]:
            same = left & (np.linalg.norm(points - points[k], axis=1) < 2.0 * TOUCHING)
            merged[same], left[same] = points[k], False
    return merged.reshape(ends.shape)


def _perimeter_between(points: Array) -> Array:
    """The perimeter counterclockwise, in parts between its corners and those of the points that lie on it."""
    at = [on_perimeter(x) for x in points]
    stops, found = np.unique([*(s % 4.0 for s in at if not np.isnan(s)), 0.0, 1.0, 2.0, 3.0]), []
    on = {s % 4.0: x for s, x in zip(at, points, strict=True) if not np.isnan(s)}
    places = [on.get(s, _at(s)) for s in stops]
    for a, b in zip(places, [*places[1:], places[0]], strict=True):
        if np.linalg.norm(b - a) > 0.0:
            found.append([a, b])
    return np.array(found)


def _at(s: float) -> Array:
    """The point of the perimeter at an arc length."""
    k = int(s) % 4
    return np.asarray(CORNERS_OF_SQUARE[k] + (s - int(s)) * (CORNERS_OF_SQUARE[(k + 1) % 4] - CORNERS_OF_SQUARE[k]))


def _faces(a: Array, b: Array) -> list[tuple[tuple[int, int], float, float]]:
    """The face of the cell that a part of the perimeter lies on: ((axis, side), begin, end)."""
    s = on_perimeter(0.5 * (a + b))
    k, length = int(s), float(np.linalg.norm(b - a))
    return wet_faces(max(k, s - 0.5 * length), min(k + 1, s + 0.5 * length))


def _loops(ends: Array) -> list[list[int]] | None:
    """Closed loops of directed parts, the inside on their left; None if some part does not belong to one."""
    _, number = np.unique(ends.reshape(-1, 2).round(DECIMALS), axis=0, return_inverse=True)
    number = number.reshape(-1, 2)
    along = ends[:, 1] - ends[:, 0]
    angle = np.arctan2(along[:, 1], along[:, 0])
    leaving: dict[int, list[int]] = {}
    for part, (begin, _) in enumerate(number):
        leaving.setdefault(int(begin), []).append(part)
    left, loops = set(range(len(ends))), []
    while left:
        first = now = min(left)
        loop = []
        while now in left:
            left.remove(now)
            loop.append(now)
            ahead = leaving.get(int(number[now, 1]))
            if ahead is None:
                return None
            # the sharpest turn to the left: the first one clockwise from the way back
            back = angle[now] + np.pi
            now = ahead[int(np.argmin((back - angle[ahead] - SAME_POINT) % (2.0 * np.pi)))]
        if now != first:
            return None
        loops.append(loop)
    return loops
