"""Regions of the fluid in cells in 3D where surfaces touch, cross or overlap: the cell without the union of the bodies.

The surfaces divide the cell into convex parts, each inside or outside of each body (`kernels.divide_cells`), which are
connected across their faces. The triangles that bound a region form a closed surface, to rounding, so that
int grad f = int f n in it (docs/theory_fluid.md, Bodies that touch or overlap).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers import kernels
from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices
from solvers.fluid.geometry.pieces import NOTHING
from solvers.fluid.geometry.regions.face_regions import in_cells
from solvers.fluid.geometry.regions.region_integrals import over_faces, over_surfaces
from solvers.fluid.geometry.regions.sliced_facets import SlicedFacets
from solvers.fluid.geometry.regions.touching_regions import TOUCHING
from solvers.fluid.geometry.regions.wet_edges import EdgeLattice
from solvers.fluid.grid.box import Grid
from solvers.mesh.tessellation import unit_normals

SURFACE, CLOSING = -1, -2  #: kinds of triangles; from 0 on: 2 axis + side, in a face of the cell
APART = 0  #: state of cells, returned by the kernel, in which no bodies touch; negative: not found
NO_AREA = 1e-14  #: twice the area of triangles, relative to a face of the cell, that is rounding error
KNOWN = 1000  #: weight of a corner's wetness among those that `wet_edges` compares


@dataclass(frozen=True)
class TouchingCells:
    """Regions in cells where bodies touch; triangles counterclockwise as seen from outside of the fluid."""

    cells: Indices  #: numbers in the box, sorted
    cell: Indices  #: of each region, number in the box
    share: Array  #: its volume, relative to the cell
    region: Indices  #: of each triangle
    kind: Indices
    facet: Indices  #: that the triangle is part of; of other kinds: one that is near
    triangles: Array  #: in reference coordinates, shape (triangles, 3, 3)
    votes: tuple[Indices, Indices]  #: corners of the lattice whose wetness is known, and KNOWN or -KNOWN

    @cached_property
    def _rows(self) -> list[Indices]:
        order = np.argsort(self.region, kind="stable")
        return np.split(order, np.searchsorted(self.region[order], np.arange(1, len(self.cell))))

    def rows(self, region: int) -> Indices:
        """Triangles that bound a region."""
        return self._rows[region]

    def integrals(self, points: Array) -> Array:
        """int L_q over the regions, the first direction fastest, shape (regions, points^3)."""
        key = points.tobytes()
        if key not in self._integrals:
            total = over_surfaces(points, self.triangles, self.region, len(self.cell))
            self._integrals[key] = total.reshape(len(self.cell), -1)
        return self._integrals[key]

    @cached_property
    def _integrals(self) -> dict[bytes, Array]:
        return {}

    def area_vectors(self) -> Array:
        """int n ds over the surface of regions, n out of the solid, relative to their cells."""
        found, some = np.zeros((len(self.cell), 3)), self.kind < 0
        ways = self.triangles[some, 1:] - self.triangles[some, :1]
        np.add.at(found, self.region[some], -0.5 * np.cross(ways[:, 0], ways[:, 1]))
        return found

    def at_faces(self) -> Indices:
        """Triangles in faces of cells."""
        return np.flatnonzero(self.kind >= 0)


@dataclass(frozen=True)
class TouchingRegion:
    """One region; see `cell_regions.SpaceRegion`, whose place it takes."""

    of: TouchingCells
    number: int

    def integrals(self, points: Array) -> Array:
        """int L_q of the Lagrange basis on the tensor points, the first direction fastest, shape (points^3,)."""
        return np.asarray(self.of.integrals(points)[self.number])

    def on_face(self, axis: int, side: int, points: Array) -> Array:
        """int l_a l_b over its part of a face, relative to the face; a: in the axis after its own, b: in the next."""
        rows = self.of.rows(self.number)
        corners = self.of.triangles[rows[self.of.kind[rows] == 2 * axis + side]][..., [(axis + 1) % 3, (axis + 2) % 3]]
        corners = corners if side else corners[:, ::-1]
        chords = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 2)
        none = np.zeros(0, dtype=np.int64)
        return np.asarray(over_faces(points, chords, np.zeros(len(chords), np.int64), np.zeros((0, 2)), none, 1)[0])

    def contains(self, x: Array) -> bool:
        """Whether a point of the cell is in it: a ray from the point along the first axis leaves it once more."""
        triangles = self.of.triangles[self.of.rows(self.number)]
        inside, at = _across(triangles[..., 1:], x[1:], triangles[..., 0])
        return int((inside & (at > x[0])).sum()) % 2 == 1

    @property
    def facets(self) -> frozenset[int]:
        """Facets that bound it."""
        rows = self.of.rows(self.number)
        return frozenset(self.of.facet[rows[self.of.kind[rows] == SURFACE]].tolist())

    @property
    def surface(self) -> Array:
        """(facet, corners) of its triangles that are not in faces of the cell, shape (n, 10)."""
        rows = self.of.rows(self.number)
        rows = rows[self.of.kind[rows] < 0]
        return np.column_stack([self.of.facet[rows], self.of.triangles[rows].reshape(-1, 9)])


def contained(triangles: Array, x: Array) -> NDArray[np.bool_]:
    """Whether triangles in a plane, (n, 3, 2), contain a point, or each its own, (n, 2)."""
    return _across(triangles, x, np.zeros((len(triangles), 3)))[0]


def _across(triangles: Array, x: Array, values: Array) -> tuple[NDArray[np.bool_], Array]:
    """(whether triangles in a plane contain a point, linear interpolation there of values at their corners)."""
    a, p, q = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    twice, way = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0], x - a
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (way[:, 0] * q[:, 1] - way[:, 1] * q[:, 0]) / twice
        t = (p[:, 0] * way[:, 1] - p[:, 1] * way[:, 0]) / twice
        at = values[:, 0] + s * (values[:, 1] - values[:, 0]) + t * (values[:, 2] - values[:, 0])
        return (s >= 0.0) & (t >= 0.0) & (s + t < 1.0), at


def touching_cells(grid: Grid, polygons: SlicedFacets, facets: Indices, x: Array, fraction: Array):
    """`TouchingCells` of surfaces of several bodies; None if none touch.

    polygons: of facets (m, 3) with vertices at x [m]; fraction: of solid in each cell of the box, where bodies overlap
    counted as often as there are bodies.
    """
    ends = np.repeat(facets[:, 0], 2), facets[:, 1:].ravel()
    body = connected_parts(*ends, len(x))[facets[:, 0]][polygons.facet]
    if not len(body) or (body == body[0]).all():
        return None
    pairs = np.unique(np.stack([polygons.cell, body]), axis=1)[0]
    cells = np.unique(pairs[1:][pairs[1:] == pairs[:-1]])
    cells = cells[fraction[cells] > NOTHING]
    lattice, mine = EdgeLattice(grid), np.flatnonzero(np.isin(polygons.cell, cells))
    corners = np.ascontiguousarray(in_cells(lattice, polygons.cell[mine], polygons.corners[mine]))
    first = np.searchsorted(polygons.cell[mine], np.append(cells, grid.size))
    of_facet = in_cells(lattice, polygons.cell[mine], x[facets[polygons.facet[mine]]])
    n = unit_normals(of_facet)
    planes = np.column_stack([n, (n * of_facet[:, 0]).sum(axis=1)])
    found = kernels.divide_cells(first, fraction[cells], polygons.count[mine], corners, planes, body[mine], TOUCHING)
    of, share, rows, triangles, state, wet = found
    if not (state > APART).any():
        return None
    # beside them surface may overlap in a face only, where another body ends in a plane of the grid
    index = np.stack(np.unravel_index(cells, grid.shape, order="F"), axis=1)
    beside = np.abs(index[:, None] - index[state > APART]).max(axis=2).min(axis=1) <= 1
    touch = (state >= APART) & beside
    kept = touch[of]
    number = np.append(np.cumsum(kept) - 1, -1)
    number[:-1][~kept] = -1
    region = number[rows[:, 0]]
    ways = triangles[:, 1:] - triangles[:, :1]
    some = (region >= 0) & (np.linalg.norm(np.cross(ways[:, 0], ways[:, 1]), axis=1) > NO_AREA)
    steps = np.array([x + y + z for z in (0, lattice.strides[2]) for y in (0, lattice.strides[1]) for x in (0, 1)])
    at, corner = np.nonzero((wet >= 0) & touch[:, None])
    votes = lattice.corner(cells[at]) + steps[corner], np.where(wet[at, corner] == 1, KNOWN, -KNOWN)
    return TouchingCells(
        cells[touch],
        cells[of[kept]],
        share[kept],
        region[some],
        rows[some, 1],
        polygons.facet[mine][rows[some, 2]],
        triangles[some],
        votes,
    )


def touching_links(grid: Grid, touching: TouchingCells, number: Indices, other_side) -> tuple[Indices, Indices]:
    """(rows (region, side of the face, number of what is on its other side, axis), triangles with nothing there).

    number: of each region; other_side: (cell in which no bodies touch, axis, side, point in its reference coordinates)
    -> number of what is at this face of the cell, or -1.
    """
    rows = touching.at_faces()
    axis, side = np.divmod(touching.kind[rows], 2)
    cell = touching.cell[touching.region[rows]]
    index, shape = np.stack(np.unravel_index(cell, grid.shape, order="F"), axis=1), np.array(grid.shape)
    beyond = index[np.arange(len(rows)), axis] + 2 * side - 1
    inside = (beyond >= 0) & (beyond < shape[axis])
    strides = np.cumprod([1, *shape[:-1]])
    rows, axis, side, there = rows[inside], axis[inside], side[inside], (cell + (2 * side - 1) * strides[axis])[inside]
    at = touching.triangles[rows].mean(axis=1)
    found = np.append(number, -1)[_opposite(touching, there, 2 * axis + 1 - side, at)]
    for k in np.flatnonzero(~np.isin(there, touching.cells)).tolist():
        found[k] = other_side(int(there[k]), int(axis[k]), int(1 - side[k]), at[k])
    some = found >= 0
    links = np.stack([touching.region[rows], side, found, axis], axis=1)
    return links[some], rows[~some]


def _opposite(touching: TouchingCells, cell: Indices, kind: Indices, x: Array) -> Indices:
    """The region with a triangle in a face of its cell that contains a point; -1: there is none.

    cell, kind: of the faces, (n,); x: in reference coordinates, (n, 3).
    """
    rows = touching.at_faces()
    key = 6 * touching.cell[touching.region[rows]] + touching.kind[rows]
    order = np.argsort(key, kind="stable")
    first, behind = (np.searchsorted(key[order], 6 * cell + kind, side=side) for side in ("left", "right"))
    count = behind - first
    point = np.repeat(np.arange(len(cell)), count)
    place = np.arange(len(point)) - np.repeat(np.cumsum(count) - count, count)
    triangle = rows[order[np.repeat(first, count) + place]]
    plane = (kind[point, None] // 2 + [1, 2]) % 3
    corners = np.take_along_axis(touching.triangles[triangle], plane[:, None], axis=2)
    inside = contained(corners, np.take_along_axis(x[point], plane, axis=1))
    found = np.full(len(cell), -1)
    found[point[inside][::-1]] = touching.region[triangle[inside]][::-1]  # the first triangle is the last one written
    return found
