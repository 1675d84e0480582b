"""The flow rate through the part of a plane, in 2D of a line, that is in the fluid.

In coordinates (s, t) of the plane, whose part in a cell is a convex polygon, bodies are polygons, too. Between
neighbouring values of s at which something has a corner or two edges cross, the ends of all intervals of t in the fluid
are linear in s. Gauss points in s and in t therefore integrate the velocity of the cell exactly. Along a line s = const
the winding number of the bodies is the number of edges passed, with sign. In 2D there is one line.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from solvers import fem
from solvers.api import Array
from solvers.fluid.flow.field import Fluid
from solvers.mesh.gauss import gauss

#: Intervals shorter than this part of a cell are rounding.
EMPTY_INTERVAL = 1e-13


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

    def at(self, s: float, t: Array) -> Array:
        """Points [m] with these coordinates, shape (n, dim)."""
        along = t[:, None] * self.axes[-1]
        return self.point + along if len(self.axes) == 1 else self.point + s * self.axes[0] + along


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


def flow_through(fluid: Fluid, point: Sequence[float], normal: Sequence[float]) -> Callable[[], dict[str, float]]:
    """Probe of the flow rate [m^3/s] towards the normal through a plane, in 2D through a line [m^2/s] (collective)."""
    plane = make_plane(point, normal)
    uncut: dict[int, Array] = {}  # local cell -> weights of its velocities
    made_of = fluid.grid

    def probe() -> dict[str, float]:
        nonlocal made_of
        if fluid.grid is not made_of:  # thin bodies have gone to other cells
            uncut.clear()
            made_of = fluid.grid
        low, high = _bounds(fluid)
        edges, rate = _edges(plane, fluid.cut.motion.x[fluid.cut.facets]), 0.0
        for cells, known in ((fluid.cut.uncut, uncut), (fluid.cut.cut, {})):
            mine = cells[cells < fluid.grid.owned]
            for cell in mine[_cross(plane, low[mine], high[mine])].tolist():
                if cell not in known:
                    bodies = edges if known is not uncut else edges[:0]
                    known[cell] = _weights(fluid, plane, cell, low[cell], high[cell], bodies)
                rate += float((known[cell] * fluid.flow[fluid.unknowns.cell_velocity[cell]]).sum())
        return {"": fluid.comm.allreduce(rate)}

    return probe


def _bounds(fluid: Fluid) -> tuple[Array, Array]:
    """Lowest and highest corners [m] of the local cells."""
    grid = fluid.grid
    if grid.nested is not None:
        return grid.nested.bounds(grid.in_nested())
    index = np.unravel_index(grid.numbers, grid.grid.shape, order="F")
    low, high = (
        np.stack([edge[i + side] for edge, i in zip(grid.grid.edges, index, strict=True)], axis=1) for side in (0, 1)
    )
    return low, high


def _cross(plane: CrossingPlane, low: Array, high: Array) -> Array:
    """Mask of the cells that the plane crosses. A face in the plane belongs to the cell behind it."""
    corners = np.stack([plane.distance(_corner(low, high, side)) for side in product((0, 1), repeat=low.shape[1])])
    return (corners.min(axis=0) < 0.0) & (corners.max(axis=0) >= 0.0)


def _corner(low: Array, high: Array, side: Sequence[int]) -> Array:
    return np.where(np.asarray(side) == 1, high, low)


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


def _weights(fluid: Fluid, plane: CrossingPlane, cell: int, low: Array, high: Array, edges: Array) -> Array:
    """Weights of the velocities of a cell in the flow rate, shape (functions, dim)."""
    polygon = _polygon(plane, low, high)
    size = float(np.linalg.norm(high - low))
    near = edges[
        (edges[..., 0].max(axis=1) >= polygon[:, 0].min()) & (edges[..., 0].min(axis=1) <= polygon[:, 0].max())
    ]
    degree, dim = fluid.unknowns.degree, fluid.grid.dim
    nodes, shares = gauss((degree * dim + dim) // 2)
    points, weights = [np.zeros((0, dim))], [np.zeros(0)]
    for s, share in _lines(polygon, near, size, len(nodes)) if dim == 3 else [(0.0, 1.0)]:
        for begin, end in _in_fluid(polygon, near, s, size):
            points.append(plane.at(s, begin + (end - begin) * nodes))
            weights.append(share * (end - begin) * shares)
    reference, weight = (np.concatenate(points) - low) / (high - low), np.concatenate(weights)
    if (sheets := fluid.grid.sheets) is not None and (number := int(fluid.grid.numbers[cell])) in sheets.successors:
        mine = [sheets.cell_at(number, x) == fluid.grid.in_sheets[cell] for x in reference]
        reference, weight = reference[mine], weight[mine]
    if not len(weight):  # a body covers all of the section
        return np.zeros((1, dim))
    shapes, _ = fem.tabulate_lagrange(fluid.grid.domain, degree, reference)
    return np.outer(weight @ shapes, plane.normal)


def _polygon(plane: CrossingPlane, low: Array, high: Array) -> Array:
    """Corners (s, t) of the part of the plane in a cell, in their order, shape (n, 2)."""
    sides = list(product((0, 1), repeat=len(low)))
    x = np.array([_corner(low, high, side) for side in sides])
    distance, found = plane.distance(x), []
    for i, first in enumerate(sides):
        if distance[i] == 0.0:
            found.append(x[i])
        for j, second in enumerate(sides[:i]):
            on_edge = sum(a != b for a, b in zip(first, second, strict=True)) == 1
            if on_edge and distance[i] * distance[j] < 0.0:
                found.append(x[i] + distance[i] / (distance[i] - distance[j]) * (x[j] - x[i]))
    corners = plane.coordinates(np.array(found))
    way = corners - corners.mean(axis=0)
    return corners[np.argsort(np.arctan2(way[:, 1], way[:, 0]))]


def _lines(polygon: Array, edges: Array, size: float, points: int) -> list[tuple[float, float]]:
    """(s, weight) of Gauss points between all s at which something has a corner or two edges cross."""
    sides = np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1)
    both = np.concatenate([sides, edges])
    breaks = np.concatenate([both[..., 0].ravel(), _crossings(both)])
    low, high = polygon[:, 0].min(), polygon[:, 0].max()
    breaks = np.unique(np.clip(breaks, low, high))
    nodes, weights = gauss(points)
    return [
        (a + (b - a) * x, (b - a) * w)
        for a, b in pairwise(breaks)
        if b - a > EMPTY_INTERVAL * size
        for x, w in zip(nodes, weights, strict=True)
    ]


def _crossings(edges: Array) -> Array:
    """The s at which edges cross each other."""
    begin, way = edges[:, 0], edges[:, 1] - edges[:, 0]
    i, j = np.triu_indices(len(edges), 1)
    between = begin[j] - begin[i]
    across = way[i, 0] * way[j, 1] - way[i, 1] * way[j, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (between[:, 0] * way[j, 1] - between[:, 1] * way[j, 0]) / across
        other = (between[:, 0] * way[i, 1] - between[:, 1] * way[i, 0]) / across
    met = (along >= 0.0) & (along <= 1.0) & (other >= 0.0) & (other <= 1.0)
    return begin[i[met], 0] + along[met] * way[i[met], 0]


def _in_fluid(polygon: Array, edges: Array, s: float, size: float) -> list[tuple[float, float]]:
    """Intervals of t in a polygon and outside of all bodies, along the line of a given s."""
    ends, _ = _met(np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1), s)
    if not len(ends):  # in 2D the line itself
        ends = polygon[:, 1]
    low, high = ends.min(), ends.max()
    t, turns = _met(edges, s)
    order = np.argsort(t, kind="stable")
    windings = np.concatenate([[0], np.cumsum(turns[order])])
    ends = np.clip(np.concatenate([[-np.inf], t[order], [np.inf]]), low, high)
    return [
        (a, b)
        for a, b, winding in zip(ends[:-1], ends[1:], windings, strict=True)
        if winding == 0 and b - a > EMPTY_INTERVAL * size
    ]


def _met(edges: Array, s: float) -> tuple[Array, Array]:
    """(t at which edges meet the line of a given s, 1 or -1 by their direction)."""
    first, last = edges[:, 0], edges[:, 1]
    met = (first[:, 0] < s) != (last[:, 0] < s)
    first, last = first[met], last[met]
    way = last - first
    return first[:, 1] + (s - first[:, 0]) / way[:, 0] * way[:, 1], np.where(way[:, 0] > 0.0, 1, -1)
