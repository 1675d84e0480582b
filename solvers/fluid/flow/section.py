"""Integrals over the part of a plane, in 2D of a line, that is in the fluid: flow rate, area, mean pressure.

The plane has coordinates (s, t). Its part in a cell is convex, and bodies are polygons in it. Between neighbouring
values of s at which something has a corner or two edges cross, the ends of all intervals of t in the fluid are linear
in s. Gauss points in s and in t therefore integrate the functions of the cell exactly. Along a line s = const the
winding number of the bodies is the number of edges passed, with sign. In 2D there is one line.

All cells are treated at once, in flat arrays: what belongs to a cell or a line has its number beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid.flow.field import Fluid
from solvers.mesh.gauss import gauss

Numbers = NDArray[np.integer]

#: Intervals shorter than this part of a cell are rounding.
EMPTY_INTERVAL = 1e-13
#: Corners of cells as near to the plane as this, in parts of the largest coordinate, are in it.
IN_CELL_FACES = 1e-14
#: Pairs of a cell and an edge that are looked at together.
BATCH = 4_000_000


@dataclass(frozen=True)
class CrossingPlane:
    """A plane in 3D, a line in 2D, with coordinates in it."""

    point: Array  #: a point of it [m]
    normal: Array  #: of length 1
    axes: Array  #: orthonormal directions in it, shape (dim - 1, dim): s (in 3D), t

    def distance(self, x: Array) -> Array:
        """Distance [m] of points along the normal."""
        return (x - self.point) @ self.normal

    def coordinates(self, x: Array) -> Array:
        """(s, t) [m] of points, in 2D (0, t); shape (..., 2)."""
        inside = (x - self.point) @ self.axes.T
        return inside if len(self.axes) == 2 else np.concatenate([np.zeros_like(inside), inside], axis=-1)

    def at(self, s: Array, t: Array) -> Array:
        """Points [m] with these coordinates, shape (n, dim)."""
        along = t[:, None] * self.axes[-1]
        return self.point + along if len(self.axes) == 1 else self.point + s[:, None] * self.axes[0] + along


def make_plane(point: Sequence[float], normal: Sequence[float]) -> CrossingPlane:
    """The plane through a point at right angles to a direction."""
    n = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    if len(n) == 2:
        axes = np.array([[-n[1], n[0]]])
    else:
        s = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
        s /= np.linalg.norm(s)
        axes = np.stack([s, np.cross(n, s)])
    return CrossingPlane(np.asarray(point, dtype=float), n, axes)


@dataclass(frozen=True)
class Crossed:
    """Parts of the plane in cells of this process."""

    cells: Numbers  #: local cells, in increasing order
    low: Array  #: their lowest corners [m], shape (n, dim)
    high: Array  #: their highest corners [m]
    ends: Array  #: least and largest s of the plane in each, shape (n, 2)
    corners: tuple[Numbers, Array]  #: (number of the part, s) of all corners of the parts

    @property
    def empty(self) -> Array:
        """Lengths [m] that are rounding."""
        return EMPTY_INTERVAL * np.linalg.norm(self.high - self.low, axis=1)


def plane_probe(
    fluid: Fluid, quantity: str, point: Sequence[float], normal: Sequence[float]
) -> Callable[[], dict[str, float]]:
    """Probe of the open part of a plane, in 2D of a line per depth (collective).

    flow_rate [m^3/s]: towards the normal; area [m^2]: that is in the fluid; pressure [Pa]: its mean over this area,
    nan where bodies cover all.
    """
    plane = make_plane(point, normal)

    def probe() -> dict[str, float]:
        cells, reference, weights = open_section(fluid, plane)
        if quantity == "flow_rate":
            velocity = _values(fluid, fluid.unknowns.cell_velocity[cells], fluid.unknowns.degree, reference)
            return {"": fluid.comm.allreduce(float(weights @ velocity @ plane.normal))}
        area = fluid.comm.allreduce(float(weights.sum()))
        if quantity == "area":
            return {"": area}
        pressure = _values(fluid, fluid.unknowns.cell_pressure[cells], 1, reference)
        total = fluid.comm.allreduce(float(weights @ pressure))
        return {"": total / area if area > 0.0 else float("nan")}

    return probe


def _values(fluid: Fluid, dofs: Numbers, degree: int, reference: Array) -> Array:
    """Values of the flow at reference points, from the dofs of the cell of each, shape (n, functions, ...)."""
    if not len(reference):  # basix ends the process without points
        return np.zeros((0, *dofs.shape[2:]))
    shapes, _ = fem.tabulate_lagrange(fluid.grid.domain, degree, reference)
    return np.asarray(np.einsum("nf,nf...->n...", shapes, fluid.flow[dofs]))


def open_section(fluid: Fluid, plane: CrossingPlane) -> tuple[Numbers, Array, Array]:
    """Gauss points of the part of a plane in the fluid: (local cells, reference points (n, dim), weights [m^2])."""
    low, high = cell_bounds(fluid)
    edges = _edges(plane, fluid.cut.images.x[fluid.cut.images.facets])
    parts = [_points(fluid, plane, cells, low, high, some) for cells, some in (
        (fluid.cut.uncut, edges[:0]), (fluid.cut.cut, edges),
    )]  # fmt: skip
    cells, x, weights = (np.concatenate(each) for each in zip(*parts, strict=True))
    reference = (x - low[cells]) / (high - low)[cells]
    if (sheets := fluid.grid.sheets) is not None:
        numbers = fluid.grid.numbers[cells]
        mine = np.ones(len(cells), dtype=bool)
        for i in np.flatnonzero(np.isin(numbers, list(sheets.successors))):
            mine[i] = sheets.cell_at(int(numbers[i]), reference[i]) == fluid.grid.in_sheets[cells[i]]
        cells, reference, weights = cells[mine], reference[mine], weights[mine]
    return cells, reference, weights


def _points(
    fluid: Fluid, plane: CrossingPlane, cells: Numbers, low: Array, high: Array, edges: Array
) -> tuple[Numbers, Array, Array]:
    """(local cells, points [m], weights) of the plane in some cells, outside of the bodies with these edges."""
    mine = np.sort(cells[cells < fluid.grid.owned])
    parts = _crossed(plane, mine, low[mine], high[mine])
    degree, dim = fluid.unknowns.degree, fluid.grid.dim
    nodes, shares = gauss((degree * dim + dim) // 2)
    part, edge = _near(parts, edges)
    if dim == 3:
        part_of, s, share = _lines(plane, parts, edges, part, edge, nodes, shares)
    else:
        part_of, s, share = np.arange(len(parts.cells)), np.zeros(len(parts.cells)), np.ones(len(parts.cells))
    line, begin, end = _in_fluid(plane, parts, edges, (part, edge), part_of, s)
    t = begin[:, None] + (end - begin)[:, None] * nodes
    weights = (share[line] * (end - begin))[:, None] * shares
    x = plane.at(np.repeat(s[line], len(nodes)), t.ravel())
    return parts.cells[np.repeat(part_of[line], len(nodes))], x, weights.ravel()


def cell_bounds(fluid: Fluid) -> tuple[Array, Array]:
    """Lowest and highest corners [m] of the local cells."""
    grid = fluid.grid
    if grid.nested is not None:
        return grid.nested.bounds(grid.in_nested())
    index = np.unravel_index(grid.numbers, grid.grid.shape, order="F")
    low, high = (
        np.stack([edge[i + side] for edge, i in zip(grid.grid.edges, index, strict=True)], axis=1) for side in (0, 1)
    )
    return low, high


def _crossed(plane: CrossingPlane, cells: Numbers, low: Array, high: Array) -> Crossed:
    """The cells that the plane crosses. A face in the plane belongs to the cell behind it."""
    sides = list(product((0, 1), repeat=low.shape[1]))
    x = np.stack([np.where(np.asarray(side) == 1, high, low) for side in sides], axis=1)
    distance = plane.distance(x)
    distance[np.abs(distance) <= IN_CELL_FACES * max(np.abs(x).max(initial=0.0), np.abs(plane.point).max())] = 0.0
    there = (distance.min(axis=1, initial=np.inf) < 0.0) & (distance.max(axis=1, initial=-np.inf) >= 0.0)
    x, distance = x[there], distance[there]
    part, corner = np.nonzero(distance == 0.0)
    parts, found = [part], [plane.coordinates(x[part, corner])[:, 0]]
    for i, first in enumerate(sides):
        for j, second in enumerate(sides[:i]):
            if sum(a != b for a, b in zip(first, second, strict=True)) == 1:
                part = np.flatnonzero(distance[:, i] * distance[:, j] < 0.0)
                way = distance[part, i] / (distance[part, i] - distance[part, j])
                parts.append(part)
                found.append(plane.coordinates(x[part, i] + way[:, None] * (x[part, j] - x[part, i]))[:, 0])
    part, s = np.concatenate(parts), np.concatenate(found)
    ends = np.stack([np.full(len(x), np.inf), np.full(len(x), -np.inf)], axis=1)
    np.minimum.at(ends[:, 0], part, s)
    np.maximum.at(ends[:, 1], part, s)
    return Crossed(cells[there], low[there], high[there], ends, (part, s))


def _edges(plane: CrossingPlane, facets: Array) -> Array:
    """Ends (s, t) of the edges that the plane cuts out of facets, (n, 2, 2), the body on the same side of all.

    In 2D the plane is a line, t; a point of it stands for an edge from s = -1 to 1, or from 1 to -1.
    """
    if not len(facets):
        return np.zeros((0, 2, 2))
    distance = plane.distance(facets)
    behind = distance < 0.0
    facets, distance, behind = (each[behind.any(axis=1) & ~behind.all(axis=1)] for each in (facets, distance, behind))
    corners, ends, rows = facets.shape[1], [], np.arange(len(facets))
    pairs = [(i, (i + 1) % corners) for i in range(corners)] if corners > 2 else [(0, 1)]
    for leaves in (True, False):
        found = np.zeros((len(facets), 2))
        for i, j in pairs:
            here = rows[behind[:, i] & ~behind[:, j]] if leaves else rows[~behind[:, i] & behind[:, j]]
            first, last = (i, j) if leaves else (j, i)  # neighbours find the same point
            a, b = distance[here, first], distance[here, last]
            x = facets[here, first] + (a / (a - b))[:, None] * (facets[here, last] - facets[here, first])
            found[here] = plane.coordinates(x)
        ends.append(found)
    if corners > 2:
        return np.stack(ends, axis=1)
    t, way = (ends[0] + ends[1])[:, 1], np.where(behind[:, 0], 1.0, -1.0)
    return np.stack([np.stack([-way, t], axis=1), np.stack([way, t], axis=1)], axis=1)


def _near(parts: Crossed, edges: Array) -> tuple[Numbers, Numbers]:
    """(part, edge) of all pairs that have an s in common, in the order of the parts."""
    first, last = edges[..., 0].min(axis=1), edges[..., 0].max(axis=1)
    pieces = -(-len(parts.cells) * len(edges) // BATCH) or 1
    found, start = [], 0
    for ends in np.array_split(parts.ends, pieces):
        part, edge = np.nonzero((last >= ends[:, :1]) & (first <= ends[:, 1:]))
        found.append((part + start, edge))
        start += len(ends)
    part, edge = (np.concatenate(each) for each in zip(*found, strict=True))
    return part, edge


def _lines(
    plane: CrossingPlane, parts: Crossed, edges: Array, part: Numbers, edge: Numbers, nodes: Array, shares: Array
) -> tuple[Numbers, Array, Array]:
    """(part, s, weight) of Gauss points between all s at which something has a corner or two edges cross."""
    where, s = [parts.corners[0], np.repeat(part, 2)], [parts.corners[1], edges[edge, :, 0].ravel()]
    for axis, side in product(range(3), (parts.low, parts.high)):  # edges that cross a side of the cell
        beyond = plane.at(edges[edge, :, 0].ravel(), edges[edge, :, 1].ravel())[:, axis].reshape(-1, 2)
        beyond -= side[part, axis][:, None]
        crosses = np.flatnonzero((beyond[:, 0] < 0.0) != (beyond[:, 1] < 0.0))
        way = beyond[crosses, 0] / (beyond[crosses, 0] - beyond[crosses, 1])
        begin, end = edges[edge[crosses], :, 0].T
        where.append(part[crosses])
        s.append(begin + way * (end - begin))
    crossing, s_crossing = _crossings(plane, parts, edges, part, edge)
    number, breaks = np.concatenate([*where, crossing]), np.concatenate([*s, s_crossing])
    breaks = np.clip(breaks, *parts.ends[number].T)
    order = np.lexsort((breaks, number))
    number, breaks = number[order], breaks[order]
    length = np.diff(breaks)
    kept = np.flatnonzero((number[1:] == number[:-1]) & (length > parts.empty[number[:-1]]))
    found = breaks[kept][:, None] + length[kept][:, None] * nodes
    weights = length[kept][:, None] * shares
    return np.repeat(number[kept], len(nodes)), found.ravel(), weights.ravel()


def _crossings(
    plane: CrossingPlane, parts: Crossed, edges: Array, part: Numbers, edge: Numbers
) -> tuple[Numbers, Array]:
    """(part, s) at which two edges cross in a cell."""
    x = plane.at(edges[edge, :, 0].ravel(), edges[edge, :, 1].ravel()).reshape(len(edge), 2, 3)
    inside = np.all((x.min(axis=1) <= parts.high[part]) & (x.max(axis=1) >= parts.low[part]), axis=1)
    part, edge = part[inside], edge[inside]
    counts = np.bincount(part, minlength=len(parts.cells))
    one = np.repeat(np.arange(len(part)), counts[part])
    other = ragged(np.cumsum(counts)[part] - counts[part], counts[part])
    one, other = one[other > one], other[other > one]
    i, j = edge[one], edge[other]
    begin, way = edges[:, 0], edges[:, 1] - edges[:, 0]
    between = begin[j] - begin[i]
    across = way[i, 0] * way[j, 1] - way[i, 1] * way[j, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (between[:, 0] * way[j, 1] - between[:, 1] * way[j, 0]) / across
        beside = (between[:, 0] * way[i, 1] - between[:, 1] * way[i, 0]) / across
    met = (along >= 0.0) & (along <= 1.0) & (beside >= 0.0) & (beside <= 1.0)
    return part[one[met]], begin[i[met], 0] + along[met] * way[i[met], 0]


def ragged(first: Numbers, counts: Numbers) -> Numbers:
    """The numbers first, first + 1, ..., `counts` of them, of each row one after the other."""
    ends = np.cumsum(counts)
    return np.asarray(np.repeat(first - ends + counts, counts) + np.arange(counts.sum()))


def _in_fluid(
    plane: CrossingPlane, parts: Crossed, edges: Array, near: tuple[Numbers, Numbers], part_of: Numbers, s: Array
) -> tuple[Numbers, Array, Array]:
    """(line, begin, end) of intervals of t that are in the cell of a line and outside of all bodies."""
    low, high = _across(plane, parts, part_of, s)
    part, edge = near
    counts = np.bincount(part, minlength=len(parts.cells))
    line = np.repeat(np.arange(len(s)), counts[part_of])
    edge = edge[ragged((np.cumsum(counts) - counts)[part_of], counts[part_of])]
    first, last = edges[edge, 0], edges[edge, 1]
    met = (first[:, 0] < s[line]) != (last[:, 0] < s[line])
    line, first, way = line[met], first[met], (last - first)[met]
    t = first[:, 1] + (s[line] - first[:, 0]) / way[:, 0] * way[:, 1]
    turns = np.where(way[:, 0] > 0.0, 1, -1)
    line = np.concatenate([np.arange(len(s)), line])
    t = np.concatenate([np.full(len(s), -np.inf), t])
    turns = np.concatenate([np.zeros(len(s), dtype=np.int64), turns])
    order = np.lexsort((t, line))
    line, t, sums = line[order], t[order], np.cumsum(turns[order])
    starts = np.flatnonzero(np.isneginf(t))
    winding = sums - sums[starts][line] if len(starts) else sums
    ends = np.append(t[1:], -np.inf)
    ends = np.where(np.isneginf(ends), np.inf, ends)
    begin, end = np.clip(t, low[line], high[line]), np.clip(ends, low[line], high[line])
    kept = (winding == 0) & (end - begin > parts.empty[part_of[line]])
    return line[kept], begin[kept], end[kept]


def _across(plane: CrossingPlane, parts: Crossed, part_of: Numbers, s: Array) -> tuple[Array, Array]:
    """Least and largest t in the cell of each line."""
    origin, way = plane.at(s, np.zeros(len(s))), plane.axes[-1]
    low, high = np.full(len(s), -np.inf), np.full(len(s), np.inf)
    for axis in np.flatnonzero(np.abs(way) > IN_CELL_FACES):
        ends = np.stack([side[part_of, axis] - origin[:, axis] for side in (parts.low, parts.high)]) / way[axis]
        low, high = np.maximum(low, ends.min(axis=0)), np.minimum(high, ends.max(axis=0))
    return low, np.maximum(low, high)
