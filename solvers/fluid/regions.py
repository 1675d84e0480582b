"""Connected parts of the fluid in single cells, in the plane: a body thinner than a cell leaves two of them.

The surface enters and leaves a cell through its perimeter. Between the place where one chord of the surface enters and
the next one, counterclockwise, where a chord leaves, the perimeter is wet. So a part of the fluid is bounded by chords,
run backwards, and pieces of the perimeter in turn (Weiler, Atherton, SIGGRAPH 1977).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.box import Grid
from solvers.gauss import gauss

#: Length, relative to a cell, below which two points are one, and area below which two areas are the same.
SAME = 1e-9

CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@dataclass(frozen=True)
class Region:
    """Part of the fluid in a cell; lengths are relative to the cell."""

    cell: int  #: number in the box
    share: float  #: of the cell
    #: wet parts of the cell's faces: (axis, side), begin and end
    faces: tuple[tuple[tuple[int, int], float, float], ...]
    facets: frozenset[int] | None = None  #: facets that bound it here; None: all that are in the cell
    polygon: Array = field(default_factory=lambda: np.empty((0, 2)))  #: corners, if it is not all fluid of the cell

    def integrals(self, points: Array) -> Array:
        """int L_q of the Lagrange basis on the tensor points, the first direction fastest, by Gauss' theorem.

        int l_a(x) l_b(y) = sum over edges of int (int_0^x l_a) l_b dy.
        """
        nodes, weights = gauss(len(points) + 1)
        start, along = self.polygon, np.roll(self.polygon, -1, axis=0) - self.polygon
        at = start[:, None] + nodes[:, None] * along[:, None]
        inner = at[..., 0, None] * nodes  # Gauss points of int_0^x
        first = np.einsum("enpa,p,en->ena", lagrange(points, inner), weights, at[..., 0])
        total = np.einsum("ena,enb,n,e->ba", first, lagrange(points, at[..., 1]), weights, along[:, 1])
        return np.asarray(total).ravel()

    def contains(self, x: Array) -> bool:
        """A point of the cell lies in it: the angles at which the edges are seen add up to a full one."""
        if self.facets is None:
            return True
        a = self.polygon - x
        b = np.roll(a, -1, axis=0)
        angles = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))
        return bool(angles.sum() > np.pi)


WHOLE = tuple(((axis, side), 0.0, 1.0) for axis in (0, 1) for side in (0, 1))


def regions_in_cell(cell: int, fluid: float, chords: Sequence[tuple[Array, Sequence[int]]]) -> list[Region]:
    """Parts of the fluid in a cell that directed polylines cut, each with the facets that it consists of.

    fluid: share of it in the cell. Polylines begin and end on the perimeter of the unit square and have the solid on
    their left. One part with wet faces all round if they do not fit together.
    """
    everything = [Region(cell, fluid, WHOLE)]
    begins, ends = ([_perimeter(chord[place]) for chord, _ in chords] for place in (0, -1))
    if np.isnan([*begins, *ends]).any():
        return everything
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
            ahead = [(end - s + SAME) % 4.0 for end in ends]
            following = int(np.argmin(ahead))
            to = s + max(0.0, ahead[following] - SAME)
            polygon += [CORNERS[k % 4] for k in range(int(np.floor(s)) + 1, int(np.ceil(to)))]
            faces += _wet(s, to)
            now = following
        if now != first:
            return everything
        region = Region(cell, 0.0, tuple(faces), frozenset(facets), np.array(polygon))
        found.append(Region(cell, _area(region.polygon), region.faces, region.facets, region.polygon))
    if abs(sum(region.share for region in found) - fluid) > SAME or min(r.share for r in found) < -SAME:
        return everything
    return found


def chords_of(grid: Grid, cell: int, x: Array, facets: NDArray[np.int64], numbers: Sequence[int]):
    """The surface in a cell as polylines in its coordinates, with their facets: some of `facets`, by their numbers."""
    i, j = np.unravel_index(cell, grid.shape, order="F")
    low = np.array([grid.edges[0][i], grid.edges[1][j]])
    size = np.array([grid.edges[0][i + 1], grid.edges[1][j + 1]]) - low
    pieces = {}
    for number in numbers:
        a, b = (x[facets[number]] - low) / size
        inside = _clip(a, b)
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
    return None if pieces else chords  # what is left closes on itself


def _clip(a: Array, b: Array) -> tuple[float, float] | None:
    """Where on the way from a to b the unit square begins and ends."""
    t0, t1 = 0.0, 1.0
    for p, q in zip(a, b, strict=True):
        if p == q:
            if not -SAME < p < 1.0 + SAME:
                return None
            continue
        enter, leave = sorted(((0.0 - p) / (q - p), (1.0 - p) / (q - p)))
        t0, t1 = max(t0, enter), min(t1, leave)
    return (t0, t1) if t1 > t0 else None


def _perimeter(x: Array) -> float:
    """Way along the perimeter of the unit square to a point of it, counterclockwise from (0, 0); NaN: off it."""
    off = np.abs([x[1], 1.0 - x[0], 1.0 - x[1], x[0]])
    side = int(np.argmin(off))
    if off[side] > SAME:
        return math.nan
    along = [x[0], x[1], 1.0 - x[0], 1.0 - x[1]][side]
    return side + float(np.clip(along, 0.0, 1.0))


def _wet(s: float, to: float) -> list[tuple[tuple[int, int], float, float]]:
    """The pieces of the sides between two places on the perimeter."""
    found = []
    for k in range(int(np.floor(s)), int(np.ceil(to))):
        a, b = max(s, k) - k, min(to, k + 1) - k
        side = [(1, 0), (0, 1), (1, 1), (0, 0)][k % 4]
        if b - a > SAME:
            found.append((side, a, b) if k % 4 < 2 else (side, 1.0 - b, 1.0 - a))
    return found


def _area(polygon: Array) -> float:
    x, y = polygon.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def lagrange(points: Array, x: Array) -> Array:
    """Lagrange polynomials on some points at x, one more axis."""
    return np.stack([np.prod([(x - p) / (q - p) for p in points if p != q], axis=0) for q in points], axis=-1)
