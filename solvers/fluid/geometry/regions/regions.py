"""Connected regions of the fluid in one cell, in 2D: a body thinner than a cell divides its fluid into two.

The surface crosses a cell in chords, which begin and end on the perimeter. The perimeter is wet from the point where a
chord enters to the next one, counterclockwise, where a chord leaves. Hence the boundary of a region alternates between
reversed chords and wet pieces of the perimeter (Weiler, Atherton, SIGGRAPH 1977).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.grid.box import Grid
from solvers.mesh.gauss import gauss
from solvers.mesh.lagrange import lagrange

#: Length and area, relative to a cell, below which two points coincide and two areas are equal.
SAME_POINT = 1e-9

#: The surface through a cell: a polyline in reference coordinates, and the facet of each of its segments.
Chord = tuple[Array, Sequence[int]]

CORNERS_OF_SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@dataclass(frozen=True)
class Region:
    """A connected part of the fluid in a cell; lengths are relative to the cell."""

    cell: int  #: number in the box
    share: float  #: its area, as a share of the cell
    #: wet parts of the cell's faces: (axis, side), begin and end
    faces: tuple[tuple[tuple[int, int], float, float], ...]
    facets: frozenset[int] | None = None  #: facets that bound it in this cell; None: it is all fluid of the cell
    polygon: Array = field(default_factory=lambda: np.empty((0, 2)))  #: corners; empty if it is all fluid of the cell
    #: where surfaces touch, the parts of facets that bound it: (facet, begin, end), shape (n, 5); None: whole facets
    surface: Array | None = None
    flush: frozenset[int] = frozenset()  #: facets that lie in its faces but do not bound it: only in 3D

    def integrals(self, points: Array) -> Array:
        """int L_q of the Lagrange basis on the tensor points, the first direction fastest, shape (points^2,).

        By Gauss' theorem, int l_a(x) l_b(y) = sum over edges of int (int_0^x l_a) l_b dy.
        """
        nodes, weights = gauss(len(points) + 1)
        start, along = self.polygon, np.roll(self.polygon, -1, axis=0) - self.polygon
        at = start[:, None] + nodes[:, None] * along[:, None]
        inner = at[..., 0, None] * nodes  # Gauss points of int_0^x
        first = np.einsum("enpa,p,en->ena", lagrange(points, inner), weights, at[..., 0])
        total = np.einsum("ena,enb,n,e->ba", first, lagrange(points, at[..., 1]), weights, along[:, 1])
        return np.asarray(total).ravel()

    def wet(self, axis: int, side: int, points: Array) -> Array:
        """int L_q over the wet part of a face, relative to the face."""
        nodes, weights = gauss(len(points) + 1)
        total = np.zeros(len(points))
        for face, a, b in self.faces:
            if face == (axis, side):
                total += (b - a) * weights @ lagrange(points, a + (b - a) * nodes)
        return total

    def contains(self, x: Array) -> bool:
        """Whether a point of the cell lies in the region: its winding number is one."""
        if self.facets is None:
            return True
        a = self.polygon - x
        b = np.roll(a, -1, axis=0)
        angles = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))
        return bool(angles.sum() > np.pi)


WHOLE_EDGES = tuple(((axis, side), 0.0, 1.0) for axis in (0, 1) for side in (0, 1))


def regions_in_cell(cell: int, fluid: float, chords: Sequence[Chord]) -> list[Region] | None:
    """Regions of the fluid in a cell that chords cut.

    fluid: share of fluid in the cell; chords: polylines with the numbers of their facets, which begin and end on the
    perimeter of the unit square and have the solid on their left.
    None if chords do not form closed boundaries, with rounding or with bodies that overlap.
    """
    chords = _divided_where_they_touch(chords)
    begins, ends = ([on_perimeter(chord[end]) for chord, _ in chords] for end in (0, -1))
    if np.isnan([*begins, *ends]).any():
        return None
    left, found = set(range(len(chords))), []
    while left:
        first = now = min(left)
        polygon, faces, facets = [], [], []
        while now in left:
            left.remove(now)
            line, there = chords[now]
            polygon += list(line[::-1])
            facets += list(there)
            s = begins[now]
            ahead = [(end - s + SAME_POINT) % 4.0 for end in ends]
            for k, way in enumerate(ahead):
                if way < 2.0 * SAME_POINT and _solid_between(chords[k][0], line):
                    ahead[k] = 4.0
            following = int(np.argmin(ahead))
            to = s + max(0.0, ahead[following] - SAME_POINT)
            polygon += [CORNERS_OF_SQUARE[k % 4] for k in range(int(np.floor(s)) + 1, int(np.ceil(to)))]
            faces += wet_faces(s, to)
            now = following
        if now != first:
            return None
        region = Region(cell, 0.0, tuple(faces), frozenset(facets), np.array(polygon))
        found.append(Region(cell, area_of(region.polygon), region.faces, region.facets, region.polygon))
    if abs(sum(region.share for region in found) - fluid) > SAME_POINT or min(r.share for r in found) < -SAME_POINT:
        return None
    return found


def _divided_where_they_touch(chords: Sequence[Chord]) -> list[Chord]:
    """The chords, divided at corners that touch the perimeter; segments along it are left as they are."""
    found: list[Chord] = []
    for line, of in chords:
        inside = [math.isnan(on_perimeter(0.5 * (a + b))) for a, b in pairwise(line)]
        cuts = [
            k for k in range(1, len(line) - 1) if inside[k - 1] and inside[k] and not math.isnan(on_perimeter(line[k]))
        ]
        found += [(line[a : b + 1], of[a:b]) for a, b in pairwise([0, *cuts, len(line) - 1])]
    return found


def _solid_between(end: Array, begin: Array) -> bool:
    """Whether solid is between a chord that ends and one that begins there: a corner of it touches the perimeter."""
    (a, b), (c, d) = begin[1] - begin[0], end[-2] - end[-1]
    return bool(a * d - b * c > 0.0)


def chords_of(grid: Grid, cell: int, x: Array, facets: NDArray[np.int64], numbers: Sequence[int]):
    """The surface in a cell as polylines in its reference coordinates, each with the numbers of its facets.

    numbers: candidates among `facets`. None if a polyline is closed within the cell.
    """
    i, j = np.unravel_index(cell, grid.shape, order="F")
    low = np.array([grid.edges[0][i], grid.edges[1][j]])
    size = np.array([grid.edges[0][i + 1], grid.edges[1][j + 1]]) - low
    pieces = {}
    corners = (x[facets[list(numbers)]] - low) / size
    for number, (a, b) in zip(numbers, corners, strict=True):
        inside = _clip(a.tolist(), b.tolist())
        if inside is not None:
            pieces[int(facets[number][0])] = (number, int(facets[number][1]), a, b, *inside)
    followers = {end for _, end, _, _, _, t in pieces.values() if t == 1.0}
    chords = []
    for start in sorted(pieces):
        if start not in pieces or (start in followers and pieces[start][4] == 0.0):
            continue
        number, end, a, b, t0, t1 = pieces.pop(start)
        line, of = [a + t0 * (b - a), a + t1 * (b - a)], [number]
        while t1 == 1.0 and end in pieces and pieces[end][4] == 0.0:
            number, end, a, b, _, t1 = pieces.pop(end)
            line.append(a + t1 * (b - a))
            of.append(number)
        chords.append((np.array(line), of))
    return None if pieces else chords  # facets that are left form a closed line


def _clip(a: list[float], b: list[float]) -> tuple[float, float] | None:
    """Parameters from 0 at a to 1 at b where the segment enters and leaves the unit square; None if it misses it."""
    t0, t1 = 0.0, 1.0
    for p, q in zip(a, b, strict=True):
        if p == q:
            if not -SAME_POINT < p < 1.0 + SAME_POINT:
                return None
            continue
        enter, leave = sorted(((0.0 - p) / (q - p), (1.0 - p) / (q - p)))
        t0, t1 = max(t0, enter), min(t1, leave)
    return (t0, t1) if t1 > t0 else None


def on_perimeter(x: Array) -> float:
    """Arc length of a point on the perimeter of the unit square, counterclockwise from (0, 0); NaN if it is off it."""
    a, b = float(x[0]), float(x[1])  # arrays of two numbers take ten times as long
    off = abs(b), abs(1.0 - a), abs(1.0 - b), abs(a)
    side = off.index(min(off))
    if not off[side] <= SAME_POINT:
        return math.nan
    along = (a, b, 1.0 - a, 1.0 - b)[side]
    return side + min(max(along, 0.0), 1.0)


def wet_faces(s: float, to: float) -> list[tuple[tuple[int, int], float, float]]:
    """Pieces of the sides between two arc lengths on the perimeter: ((axis, side), begin, end)."""
    found = []
    for k in range(int(np.floor(s)), int(np.ceil(to))):
        a, b = max(s, k) - k, min(to, k + 1) - k
        side = [(1, 0), (0, 1), (1, 1), (0, 0)][k % 4]
        if b - a > SAME_POINT:
            found.append((side, a, b) if k % 4 < 2 else (side, 1.0 - b, 1.0 - a))
    return found


def area_of(polygon: Array) -> float:
    x, y = polygon.T
    return 0.5 * float(x @ np.concatenate([y[1:], y[:1]]) - y @ np.concatenate([x[1:], x[:1]]))
