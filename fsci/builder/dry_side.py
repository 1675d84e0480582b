"""Surfaces with fluid on one side only: what closes the solid behind them, and in 2D the line that does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solvers.api import Snapshot
from solvers.fluid.surfaces.inside import winding
from solvers.fluid.surfaces.surface import Motion

if TYPE_CHECKING:
    from coupling.interface import DrySide
    from solvers.fluid.flow.field import Fluid

Array = NDArray[np.float64]
Facets = NDArray[np.int64]


class DrySideError(ValueError):
    """A line that does not close the solid; the message gives the reason."""


@dataclass(frozen=True)
class Closing:
    """What closes the solid behind a wetted surface."""

    ends: Facets  #: vertices of the wetted surface from which it starts
    corners: Array  #: fixed corners [m], shape (n, dim)
    facets: Facets  #: facets between both: numbers of the ends, then of the corners

    def joined(self, other: Closing) -> Closing:
        """Both together, as one."""
        n, m = len(self.ends), len(other.ends)
        mine = np.where(self.facets < n, self.facets, self.facets + m)
        others = other.facets + np.where(other.facets < m, n, n + len(self.corners))
        corners = np.concatenate([self.corners, other.corners])
        return Closing(np.concatenate([self.ends, other.ends]), corners, np.concatenate([mine, others]))

    def together(self, points: Array, facets: Facets) -> tuple[Array, Facets]:
        """(vertices, facets) of the wetted surface and what closes it."""
        numbers = np.concatenate([self.ends, len(points) + np.arange(len(self.corners))])
        return np.concatenate([points, self.corners]), np.concatenate([facets, numbers[self.facets]])


def find_ends(facets: Facets) -> tuple[int, int]:
    """(vertex at the end, vertex at the start) of segments that make one line. Raises DrySideError."""
    following = dict(facets.tolist())
    starts = set(following) - set(following.values())
    if len(starts) != 1 or len(following) != len(facets):
        raise DrySideError("the wetted surface must be one line with two ends")
    start = end = starts.pop()
    length = 0
    while end in following:
        end, length = following[end], length + 1
    if length != len(facets):
        raise DrySideError("the wetted surface must be one line with two ends")
    return end, start


def close(points: Array, facets: Facets, inside: Array, corners: Array, box: tuple[Array, Array]) -> Closing:
    """The line along corners that leads from the end of a wetted line back to its start, solid on the left.

    `inside`: points in the body that the line belongs to. The way round must not pass through the box, whose lowest and
    highest corners are given. Raises DrySideError.
    """
    end, start = find_ends(facets)
    way = max((corners, corners[::-1]), key=lambda some: _area(points, facets, _line(points[end], some, points[start])))
    line = _line(points[end], way, points[start])
    loop, around = _loop(points, facets, line)
    if any(winding(x, Motion(loop, np.zeros_like(loop)), around) < 1.0 - 1e-6 for x in inside):
        raise DrySideError("the body must lie between its wetted surface and these points")
    for a, b in pairwise(line):
        if _crosses(a, b, *box):
            raise DrySideError(
                f"the line from {_spoken(a)} to {_spoken(b)} crosses the box: add corners that lead around it"
            )
    numbers = np.concatenate([[0], 2 + np.arange(len(way)), [1]])
    return Closing(np.array([end, start]), way, np.stack([numbers[:-1], numbers[1:]], axis=1))


def outlines(fluid: Fluid, dry_sides: Sequence[DrySide]) -> list[Snapshot]:
    """The lines that close the solid behind surfaces with one wet side, within the box, on rank 0; none in 3D."""
    if fluid.comm.rank != 0:
        return []
    surfaces = {body.surface.name: body.surface for body in fluid.bodies}
    edges = fluid.grid.grid.edges
    low, high = (np.array([edge[at] for edge in edges]) for at in (0, -1))
    found = []
    for side in dry_sides:
        if len(edges) == 3:
            continue
        wet = fluid.cut.motion.x[fluid.moving.surfaces.vertices_of([side.behind])]
        closing = Closing(side.ends, np.clip(side.corners, low, high), side.facets)
        points, lines = closing.together(wet, surfaces[side.behind].facets)
        found.append(
            Snapshot(side.name, np.pad(points, ((0, 0), (0, 1))), lines, "line", {}, {"dry": np.ones(len(lines))})
        )
    return found


def _line(end: Array, corners: Array, start: Array) -> Array:
    return np.concatenate([[end], corners, [start]])


def _loop(points: Array, facets: Facets, line: Array) -> tuple[Array, Facets]:
    """(vertices, segments) of a wetted line and the one that closes it."""
    numbers = len(points) + np.arange(len(line))
    return np.concatenate([points, line]), np.concatenate([facets, np.stack([numbers[:-1], numbers[1:]], axis=1)])


def _area(points: Array, facets: Facets, line: Array) -> float:
    """Area enclosed by a loop, positive if it is counterclockwise [m^2]."""
    x, segments = _loop(points, facets, line)
    a, b = x[segments[:, 0]], x[segments[:, 1]]
    return float(0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())


def _crosses(a: Array, b: Array, low: Array, high: Array) -> bool:
    """Some of the way from a to b lies in the box, its boundary left out."""
    margin = 1e-9 * float((high - low).max())
    first, last = 0.0, 1.0
    for start, step, least, most in zip(a, b - a, low + margin, high - margin, strict=True):
        if step == 0.0:
            if not least < start < most:
                return False
            continue
        enters, leaves = sorted([(least - start) / step, (most - start) / step])
        first, last = max(first, enters), min(last, leaves)
    return bool(last > first)


def _spoken(point: Sequence[float] | Array) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in point) + ")"
