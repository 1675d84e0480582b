"""Nested cells: a grid whose cells are halved in some regions, up to several levels.

The edges of a cell of level l are 2^-l times those of the cell of the coarsest grid that contains it. Cells that share
a corner differ by one level at most (2:1). Every cell is a union of cells of the finest lattice. Hence algorithms near
bodies, where all cells are of the finest level, work on this lattice as on a uniform grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from solvers import kernels
from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices, Mask
from solvers.fluid.grid.box import CORNER_STEPS, FLUSH, Grid
from solvers.mesh.gauss import gauss
from solvers.mesh.lagrange import lagrange
from solvers.mesh.mesh import Mesh

#: Layers of cells of the finest level around cut cells. The roots of poorly cut nodes are up to two layers away
#: (`solvers.fluid.cut.extension`) and must not have hanging nodes.
FINE_LAYERS = 3


@dataclass(frozen=True)
class Nested(Grid):
    """A nested grid. `edges`, shape, size and numbers of the base class are those of the finest lattice."""

    first: Indices  #: number of the lowest cell of the lattice in each cell of the mesh, increasing
    width: Indices  #: cells of the lattice along each of its edges

    @cached_property
    def cell_of(self) -> NDArray[np.int32]:
        """Cell of the mesh at each cell of the lattice."""
        found, low = np.empty(self.size, dtype=np.int32), self._lowest(np.arange(len(self.first)))
        for width in np.unique(self.width):
            some = np.flatnonzero(self.width == width)
            inner = np.array(list(product(range(width), repeat=self.dim)))
            index = low[some][:, None, :] + inner
            found[np.ravel_multi_index(tuple(np.moveaxis(index, 2, 0)), self.shape, order="F")] = some[:, None]
        return found

    @cached_property
    def at_others(self) -> Mask:
        """Cells of the mesh that share a corner with finer or coarser ones."""
        width = self.as_box(self.width[self.cell_of])
        least, most = (f(width, 3, mode="nearest") for f in (ndimage.minimum_filter, ndimage.maximum_filter))
        found = np.zeros(len(self.first), dtype=bool)
        found[self.cell_of[(least < most).ravel(order="F")]] = True
        return found

    @cached_property
    def coarse(self) -> Mask:
        """Mask of the cells of the lattice that are not of the finest level in the mesh."""
        return np.asarray(self.width[self.cell_of] > 1)

    def lattice_numbers(self, cells: Indices) -> Indices:
        """Number of the lowest cell of the lattice in cells of the mesh; further cells follow the lattice's."""
        count = len(self.first)
        return np.where(cells < count, self.first[np.minimum(cells, count - 1)], cells - count + self.size)

    def coarser(self) -> Grid:
        """The grid without its finest level: the cells of that are merged, 2^dim of them to one."""
        edges, low = tuple(edge[::2] for edge in self.edges), self._lowest(np.arange(len(self.first))) // 2
        numbers = np.ravel_multi_index(tuple(low.T), [n // 2 for n in self.shape], order="F")
        first, one = np.unique(numbers, return_index=True)
        width = np.maximum(self.width[one] // 2, 1)
        return Grid(edges) if (width == 1).all() else Nested(edges, first, width)

    def bounds(self, cells: Indices) -> tuple[Array, Array]:
        """Lowest and highest corners [m] of cells of the mesh, shape (cells, dim) each."""
        index = self._lowest(cells)
        low, high = (
            np.stack([edge[i] for edge, i in zip(self.edges, corner.T, strict=True)], axis=1)
            for corner in (index, index + self.width[cells, None])
        )
        return low, high

    def nodes(self, cells: Indices, degree: int, steps: Indices) -> Indices:
        """Numbers of the nodes of cells of the mesh in the lattice of nodes of a degree, shape (cells, nodes).

        steps: from the first node of a cell to each, in the nodes of the cell, shape (nodes, dim).
        """
        index = degree * self._lowest(cells)[:, None, :] + self.width[cells, None, None] * steps
        return np.ravel_multi_index(tuple(np.moveaxis(index, 2, 0)), self._node_counts(degree), order="F")

    def all_nodes(self, degree: int) -> Indices:
        """Numbers of all nodes of the mesh in the lattice of nodes of a degree, increasing."""
        steps = np.array(list(product(range(degree + 1), repeat=self.dim)))
        return np.unique(self.nodes(np.arange(len(self.first)), degree, steps))

    def consecutive(self, numbers: Indices, degree: int) -> Indices:
        """Position of nodes in `all_nodes`; further nodes, whose numbers follow the lattice's, follow all of them."""
        nodes, size = self.all_nodes(degree), int(np.prod(self._node_counts(degree)))
        return np.where(numbers < size, np.searchsorted(nodes, numbers), len(nodes) + numbers - size)

    def corners(self, degree: int) -> Indices:
        """Numbers of the points of `picture` in the lattice of nodes of a degree, in the order of the points."""
        index = np.unravel_index(self.all_nodes(1), self._node_counts(1), order="F")
        return np.ravel_multi_index([degree * i for i in index], self._node_counts(degree), order="F")

    def mesh(self) -> Mesh:
        """The mesh for DOLFINx: two cells share a vertex if faces between equal cells connect them around it.

        DOLFINx finds vertices that processes share only by way of such faces.
        """
        corner, steps = np.arange(len(self.first) * 2**self.dim).reshape(len(self.first), -1), CORNER_STEPS[self.dim]
        low, first, second = self._lowest(np.arange(len(self.first))), [], []
        for axis, count in enumerate(self.shape):
            beyond = low.copy()
            beyond[:, axis] = np.minimum(low[:, axis] + self.width, count - 1)
            after = self.cell_of[np.ravel_multi_index(tuple(beyond.T), self.shape, order="F")]
            linked = (low[:, axis] + self.width < count) & (self.width[after] == self.width)
            upper, at_lower = (np.flatnonzero(steps[:, axis] == side) for side in (1, 0))
            mirrored = [
                at_lower[(np.delete(steps[at_lower], axis, 1) == np.delete(steps[u], axis)).all(axis=1)][0]
                for u in upper
            ]
            first.append(corner[linked][:, upper].ravel())
            second.append(corner[after[linked]][:, mirrored].ravel())
        part = connected_parts(np.concatenate(first), np.concatenate(second), corner.size)
        _, one, cells = np.unique(part, return_index=True, return_inverse=True)
        return replace(
            self.picture(),
            points=self._points(self.nodes(np.arange(len(self.first)), 1, steps).ravel()[one]),
            cells=cells.reshape(corner.shape),
        )

    def picture(self) -> Mesh:
        """The mesh for files and pictures, with one vertex at each point."""
        numbers = self.nodes(np.arange(len(self.first)), 1, CORNER_STEPS[self.dim])
        distinct, cells = np.unique(numbers, return_inverse=True)
        return Mesh(self._points(distinct), cells.reshape(numbers.shape), "quad" if self.dim == 2 else "hexahedron")

    def _points(self, numbers: Indices) -> Array:
        index = np.unravel_index(numbers, self._node_counts(1), order="F")
        return np.stack([edge[i] for edge, i in zip(self.edges, index, strict=True)], axis=1)

    def hanging(self, degree: int, nodes: Indices) -> tuple[Mask, Indices, Array]:
        """(mask of the hanging ones among some nodes, the nodes of their coarser cells, the shape functions of these).

        The last two have the shape (hanging, functions).
        """
        cells, at = self._coarsest_at(nodes, degree)
        hangs = (at % self.width[cells, None]).any(axis=1)
        return hangs, *self._shape_functions(degree, cells[hangs], at[hangs])

    def polynomials(self, degree: int, nodes: Indices) -> tuple[Indices, Array]:
        """(nodes of the widest cell at some nodes of the lattice, its shape functions), shape (nodes, functions)."""
        return self._shape_functions(degree, *self._coarsest_at(nodes, degree))

    def _shape_functions(self, degree: int, cells: Indices, at: Indices) -> tuple[Indices, Array]:
        """(nodes, shape functions) of cells at positions from 0 to degree * width in them, shape (cells, functions)."""
        along = lagrange(np.arange(degree + 1) / degree, at / (degree * self.width[cells, None]))
        steps = np.array(list(product(range(degree + 1), repeat=self.dim)))
        weights = np.prod([along[:, axis, steps[:, axis]] for axis in range(self.dim)], axis=0)
        return self.nodes(cells, degree, steps), weights

    def unknowns(self, degree: int) -> int:
        """Nodes that do not hang."""
        nodes = self.all_nodes(degree)
        return len(nodes) - int(np.count_nonzero(self.hanging(degree, nodes)[0]))

    def _coarsest_at(self, nodes: Indices, degree: int) -> tuple[Indices, Indices]:
        """The widest cell at each node, and the position of the node in it from 0 to degree * width, (nodes, dim)."""
        at = np.stack(np.unravel_index(nodes, self._node_counts(degree), order="F"), axis=1)
        best, width = np.zeros(len(nodes), dtype=np.int64), np.zeros(len(nodes), dtype=np.int64)
        for side in product((0, 1), repeat=self.dim):
            index = np.where(np.array(side) == 0, -(-at // degree) - 1, at // degree)
            index = np.clip(index, 0, np.array(self.shape) - 1)
            cell = self.cell_of[np.ravel_multi_index(tuple(index.T), self.shape, order="F")]
            wider = self.width[cell] > width
            best[wider], width[wider] = cell[wider], self.width[cell[wider]]
        return best, at - degree * self._lowest(best)

    def _lowest(self, cells: Indices) -> Indices:
        return np.stack(np.unravel_index(self.first[cells], self.shape, order="F"), axis=1)

    def _node_counts(self, degree: int) -> tuple[int, ...]:
        return tuple(degree * n + 1 for n in self.shape)


class RefinedRegion(Protocol):
    """A region whose cells have at least some level."""

    @property
    def level(self) -> int: ...

    def cells(self, grid: Grid) -> Mask:
        """Mask of the cells of a grid of this level that are in the region."""
        ...


@dataclass(frozen=True)
class RefinedBox:
    """The box between two corners [m]."""

    low: Sequence[float]
    high: Sequence[float]
    level: int

    def cells(self, grid: Grid) -> Mask:
        inside = np.ones(grid.shape, dtype=bool)
        for axis, (edge, low, high) in enumerate(zip(grid.edges, self.low, self.high, strict=True)):
            near = FLUSH * np.diff(edge)
            along = (edge[1:] > low + near) & (edge[:-1] < high - near)
            inside &= along.reshape([-1 if a == axis else 1 for a in range(grid.dim)])
        return inside.ravel(order="F")


@dataclass(frozen=True)
class RefinedSurface:
    """A surface and some layers of cells on both of its sides."""

    points: Array  #: vertices [m], shape (n, dim)
    facets: Indices
    layers: int
    level: int

    def cells(self, grid: Grid) -> Mask:
        everywhere = np.ones(grid.size, dtype=bool)
        moments = kernels.moments(grid.edges, gauss(2)[0], self.points, self.facets, everywhere)
        found = np.zeros(grid.size, dtype=bool)
        found[moments.cells] = True
        return grown(grid.as_box(found), self.layers).ravel(order="F")


def refined(grid: Grid, regions: Sequence[RefinedRegion]) -> Grid:
    """The grid with finer cells in some regions, and around them as few as 2:1 allows."""
    depth = max((region.level for region in regions), default=0)
    if depth == 0:
        return grid
    grids = [_halved(grid, level) for level in range(depth + 1)]
    split: list[Mask] = [np.zeros(grids[depth].shape, dtype=bool)]  # cells of each level that are halved, last first
    for level in range(depth, 0, -1):
        wanted = grown(split[-1], 1)
        for region in regions:
            if region.level == level:
                wanted |= grids[level].as_box(region.cells(grids[level]))
        split.append(_coarsened(wanted))
    split.reverse()
    there, first, width = np.ones(grid.shape, dtype=bool), [], []
    for level, halved in enumerate(split):
        step = 2 ** (depth - level)
        index = np.stack(np.nonzero(there & ~halved)) * step
        first.append(np.ravel_multi_index(tuple(index), grids[depth].shape, order="F"))
        width.append(np.full(index.shape[1], step))
        there = halved
        for axis in range(grid.dim):
            there = np.repeat(there, 2, axis=axis)
    order = np.argsort(np.concatenate(first))
    return Nested(grids[depth].edges, np.concatenate(first)[order], np.concatenate(width)[order])


def grown(marked: Mask, layers: int) -> Mask:
    """Marked cells and so many layers of neighbours, across corners."""
    if layers == 0:
        return marked
    return ndimage.binary_dilation(marked, np.ones((3,) * marked.ndim, dtype=bool), iterations=layers)


def _halved(grid: Grid, times: int) -> Grid:
    """The grid with each cell halved in each direction, so many times."""
    parts = 2**times
    return Grid(tuple(np.interp(np.arange(parts * n + 1) / parts, np.arange(n + 1), e) for n, e in _lengths(grid)))


def _lengths(grid: Grid) -> list[tuple[int, Array]]:
    return list(zip(grid.shape, grid.edges, strict=True))


def _coarsened(cells: Mask) -> Mask:
    """Mask of the cells twice as wide that contain a marked one."""
    for axis in range(cells.ndim):
        cells = np.logical_or.reduceat(cells, np.arange(0, cells.shape[axis], 2), axis=axis)
    return cells
