"""Discrete extension of the flow to poorly cut nodes: which nodes depend on others, and by which weights.

The share of fluid of a node is that of the best of its cells, relative to the best cell nearby. Nodes below FREE_SHARE
are dependent: each has a root, the well-cut cell nearby whose polynomial amplifies least at the node, and the extension
E u(x_i) = sum_b N_b(x_i) u_b by the shape functions of the root, continued outside of it.

A polynomial of mean square 1 in a part of a cell is at most A at a node, A^2 = |part| (M^-1)_ii with the mass matrix M
of the part. In 3D the fluid in a cell determines its worst node from FREE_SHARE on at least as well (A is as small) as
an uncut cell determines nodes one cell away, whatever the direction of a plane surface.
Sources: Badia, Neiva, Verdugo, arXiv:2106.13728 (the penalty on the distance to the extension does not lock, its limit
is the aggregated finite element method); Burman, Hansbo, Larson, arXiv:2205.01340.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from solvers.api import Array, Indices
from solvers.fluid.geometry.thin.sheet_windows import SheetWindows
from solvers.fluid.geometry.thin.sheets import Sheets
from solvers.fluid.grid.box import Grid

#: Share of fluid, relative to the best cell nearby, from which on a cell may be a root and its nodes are free, by
#: dimension. In 3D the two amplifications above are equal there for the worst plane, which cuts off a corner; with 0.6
#: Newton's method does not converge at a Reynolds number of 200. In 2D they are equal at 0.7: from 0.6 to 0.8 drags are
#: the same to 1e-4, and lifts within their scatter.
FREE_SHARE = {2: 0.6, 3: 0.81}
#: Share up to which the penalty on the distance to the extension has its full weight. Drags are the same to 1e-4 from
#: 0.05 to 0.4.
PENALISED_SHARE = 0.2

#: Layers of cells around those of a node that count as nearby.
LAYERS_NEARBY = 2

#: Parabolas are continued over PARABOLA_CELLS cells in one direction, and while they amplify by sum_b |N_b| <=
#: LARGEST_FACTOR, which bounds the amplification of rounding errors: one cell away it is 17 in one direction, 289 in
#: two, 4913 in three. Beyond, straight lines are continued.
#: Drags are the same to 2e-4 with LARGEST_FACTOR from 20 to 1e6.
PARABOLA_CELLS, LARGEST_FACTOR = 2.0, 350.0

#: Nodes that are processed together, to bound the memory.
NODES_AT_ONCE = 4096


@dataclass(frozen=True)
class Dependent:
    """Nodes with an extension, sorted, as indices into `numbers` of the `Extension`."""

    nodes: Indices
    rows: sparse.csr_matrix  #: E, shape (dependent nodes, nodes of the lattice)
    weight: Array  #: of the distance to the extension: 1 for small shares of fluid, decreasing to 0 at free nodes
    dry: NDArray[np.bool_]  #: nodes whose cells have no fluid: their values are those of the extension
    undetermined: Indices  #: nodes of active cells with no root


class Extension:
    """The extension of one lattice of nodes. Roots are fixed within a step, so that Newton's method converges."""

    def __init__(self, grid: Grid, degree: int, shape: tuple[int, ...], numbers: Indices, sheets: Sheets | None = None):
        """numbers: the nodes of this process, in the lattice of this degree and shape, x fastest, or in `sheets`.

        Along periodic axes the shape does not count the last node, and cells at both ends are neighbours.
        """
        self.grid, self.degree, self.shape, self._free = grid, degree, shape, FREE_SHARE[grid.dim]
        self._sheets = None if sheets is None else SheetWindows(sheets, degree, numbers)
        self.size = int(np.prod(shape)) if sheets is None else sheets.node_count(degree)  #: count of node numbers
        lattice_numbers = numbers if sheets is None else sheets.on_lattice(numbers, degree)
        self._index = np.stack(np.unravel_index(lattice_numbers, shape, order="F"), axis=1)
        self._strides = np.cumprod([1, *shape[:-1]])
        #: index of each node into `numbers`, -1: none
        self._index_of = np.full(self.size, -1, dtype=np.int64)
        self._index_of[numbers] = np.arange(len(numbers))
        self._lattice = [
            np.interp(np.arange(degree * (len(edge) - 1) + 1) / degree, np.arange(len(edge)), edge)
            for edge in grid.edges
        ]
        #: row of E of each node in this step, -1: none yet
        self._row_of, self._rows = np.full(len(numbers), -1), sparse.csr_matrix((0, self.size))
        self._roots: Indices = np.zeros((2, 0), dtype=np.int64)  #: (row of E, cell) of each root

    def follow(self, sheets: Sheets | None) -> None:
        """Take sheets with the same cells, of which some have more fluid now and others less."""
        if self._sheets is not None and sheets is not None:
            self._sheets.follow(sheets)

    def begin_step(self) -> None:
        """Discard the roots of the last step."""
        self._row_of[:], self._rows = -1, self._rows[:0]
        self._roots = self._roots[:, :0]

    def __call__(self, share: Array, active: NDArray[np.bool_], reach: int) -> Dependent:
        """Dependent nodes and their extension.

        share: fluid in each cell of the mesh; active: cells with unknowns; reach: largest distance of a root [cells].
        """
        nodes = self._nodes_of(np.flatnonzero(active & (share < self._free)))
        largest, best = (self._largest(nodes, share, layers) for layers in (0, LAYERS_NEARBY))
        poor = (largest < self._free * best) | (largest == 0.0)
        nodes = nodes[poor]
        relative = np.divide(largest, best, out=np.zeros(len(largest)), where=best > 0.0)[poor]
        self._forget_covered(nodes, share)
        self._find_roots(nodes[self._row_of[nodes] < 0], share, reach)
        rooted = self._row_of[nodes] >= 0
        rows = self._rows[self._row_of[nodes[rooted]]]
        return Dependent(
            nodes[rooted], rows, _weight(relative[rooted], self._free), relative[rooted] == 0.0, nodes[~rooted]
        )

    def _nodes_of(self, cells: Indices) -> Indices:
        """The nodes of cells, sorted, each once."""
        if self._sheets is not None:
            numbers = self._sheets.nodes(cells)
        else:
            index = np.unravel_index(cells, self.grid.shape, order="F")
            steps = np.arange(self.degree + 1)
            axes = [
                (self.degree * i[:, None] + steps) % n * stride
                for i, n, stride in zip(index, self.shape, self._strides, strict=True)
            ]
            numbers = reduce(_outer_sum, axes)
        indices = self._index_of[np.unique(numbers)]
        return np.sort(indices[indices >= 0])

    def _cells_around(self, nodes: Indices, layers: int) -> tuple[Indices, NDArray[np.bool_]]:
        """(cells, whether they exist) around nodes, with some further layers, shape (nodes, cells)."""
        if self._sheets is not None:
            return self._sheets.cells_around(nodes, self._index[nodes], layers)
        axes = [self._window(axis, nodes, layers) for axis in range(self.grid.dim)]
        strides = np.cumprod([1, *self.grid.shape[:-1]])
        cells = reduce(_outer_sum, (index * stride for (index, _), stride in zip(axes, strides, strict=True)))
        return cells, reduce(_outer_and, (exists for _, exists in axes))

    def _window(self, axis: int, nodes: Indices, layers: int) -> tuple[Indices, NDArray[np.bool_]]:
        """(indices, whether they exist) of cells in one direction, shape (nodes, 2 layers + 2)."""
        index, exists = self._unrolled(axis, nodes, layers)
        n = self.grid.shape[axis]
        return index % n if self._is_periodic(axis) else np.clip(index, 0, n - 1), exists

    def _unrolled(self, axis: int, nodes: Indices, layers: int) -> tuple[Indices, NDArray[np.bool_]]:
        """The same with indices beyond the ends of a period."""
        m, n = self._index[nodes, axis, None], self.grid.shape[axis]
        index = m // self.degree + np.arange(-layers - 1, layers + 1)
        exists = index >= -(-m // self.degree) - 1 - layers
        if self._is_periodic(axis):
            exists &= index < index[:, :1] + n  # each cell once
        else:
            exists &= (index >= 0) & (index < n)
        return index, exists

    def _is_periodic(self, axis: int) -> bool:
        return self._sheets is None and self.shape[axis] == self.degree * self.grid.shape[axis]

    def _largest(self, nodes: Indices, share: Array, layers: int) -> Array:
        """Largest share of fluid in the cells around nodes, with some further layers."""
        found = []
        for part in _chunks(nodes):
            cells, inside = self._cells_around(part, layers)
            found.append(np.where(inside, share[cells], 0.0).max(axis=1, initial=0.0))
        return np.concatenate(found)

    def _forget_covered(self, nodes: Indices, share: Array) -> None:
        """Discard the rows of nodes with a root that a body has covered since: its own nodes have no equation."""
        rows, cells = self._roots
        covered = np.zeros(self._rows.shape[0], dtype=bool)
        covered[rows[share[cells] == 0.0]] = True
        rooted = nodes[self._row_of[nodes] >= 0]
        self._row_of[rooted[covered[self._row_of[rooted]]]] = -1

    def _find_roots(self, nodes: Indices, share: Array, reach: int) -> None:
        """Add rows of E for nodes that have none, where a root exists: first among cells nearby, then up to `reach`."""
        for layers in dict.fromkeys([min(LAYERS_NEARBY, reach), reach]):
            for part in _chunks(nodes):
                found, rows, roots = self._search(part, share, layers)
                first = self._rows.shape[0]
                self._row_of[found] = first + np.arange(len(found))
                self._rows = sparse.vstack([self._rows, rows], format="csr")
                self._roots = np.concatenate([self._roots, roots + np.array([[first], [0]])], axis=1)
            nodes = nodes[self._row_of[nodes] < 0]

    def _search(self, nodes: Indices, share: Array, layers: int) -> tuple[Indices, sparse.csr_matrix, Indices]:
        """(nodes with a root, their rows of E, (row, cell) of each root, shape (2, roots)).

        A row is the mean over roots that amplify equally.
        """
        cost = reduce(_outer_product, (self._amplification(axis, nodes, layers) for axis in range(self.grid.dim)))
        cells, inside = self._cells_around(nodes, layers)
        fluid = np.where(inside, share[cells], 0.0)
        best = fluid.max(axis=1, initial=0.0)[:, None]
        cost = np.where((fluid >= self._free * best) & (fluid > 0.0), cost, np.inf)
        least = cost.min(axis=1, initial=np.inf)[:, None]
        at, chosen = np.nonzero((cost <= (1.0 + 1e-9) * least) & np.isfinite(cost))
        columns, weights = self._entries(nodes[at], layers, chosen, cost[at, chosen] > LARGEST_FACTOR)
        if self._sheets is not None:
            columns = self._sheets.nodes(cells[at, chosen])
        weights = weights / np.bincount(at, minlength=len(nodes))[at, None]
        found = np.unique(at)
        rows = np.broadcast_to(np.searchsorted(found, at)[:, None], columns.shape)
        kept = np.abs(weights) > 0.0
        entries = (weights[kept], (rows[kept], columns[kept]))
        roots = np.stack([np.searchsorted(found, at), cells[at, chosen]])
        return nodes[found], sparse.csr_matrix(entries, shape=(len(found), self.size)), roots

    def _coordinates(self, axis: int, nodes: Indices, layers: int) -> Array:
        """Reference coordinates of nodes in the cells of `_window`: from 0 to 1 inside, shape (nodes, cells)."""
        index, _ = self._window(axis, nodes, layers)
        edge, m = self.grid.edges[axis], self._index[nodes, axis, None]
        periods = np.zeros_like(index)
        if self._is_periodic(axis):
            unrolled = self._unrolled(axis, nodes, layers)[0]
            periods = (unrolled - index) // self.grid.shape[axis]
        x = self._lattice[axis][m] - periods * (edge[-1] - edge[0])
        outside = (x - edge[index]) / (edge[index + 1] - edge[index])
        local = m - self.degree * (index + self.grid.shape[axis] * periods)
        within = (local >= 0) & (local <= self.degree)
        return np.where(within, local / self.degree, outside)

    def _amplification(self, axis: int, nodes: Indices, layers: int) -> Array:
        """Sum of the absolute values of the 1D shape functions, continued to any distance, shape (nodes, cells)."""
        s = self._coordinates(axis, nodes, layers)
        return np.abs(lagrange(s, self.degree)).sum(axis=2)

    def _entries(self, nodes: Indices, layers: int, chosen: Indices, steep: NDArray[np.bool_]) -> tuple[Indices, Array]:
        """(lattice nodes, weights) of chosen cells of the windows, shape (chosen, functions)."""
        width = 2 * layers + 2
        columns, weights = np.zeros((len(nodes), 1), dtype=np.int64), np.ones((len(nodes), 1))
        for axis in range(self.grid.dim):
            # the window's cells are numbered with the first direction slowest, see _outer_sum
            column = (chosen // width ** (self.grid.dim - 1 - axis) % width)[:, None]
            index, _ = self._window(axis, nodes, layers)
            first = self.degree * np.take_along_axis(index, column, axis=1)
            lattice = (first + np.arange(self.degree + 1)) % self.shape[axis] * self._strides[axis]
            s = np.take_along_axis(self._coordinates(axis, nodes, layers), column, axis=1)[:, 0]
            columns, weights = _outer_sum(columns, lattice), _outer_product(weights, continued(s, self.degree, steep))
        return columns, weights


def continued(s: Array, degree: int, steep: NDArray[np.bool_]) -> Array:
    """1D shape functions at s, shape (points, functions); outside of the cell those of a line where steep or far."""
    outside = np.maximum(-s, s - 1.0)
    straight = (outside > PARABOLA_CELLS) | steep & (outside > 0.0)
    line = np.stack([1.0 - s, *[0.0 * s] * (degree - 1), s], axis=1)
    return np.where(straight[:, None], line, lagrange(s, degree))


def lagrange(s: Array, degree: int) -> Array:
    """1D shape functions at s, along one more axis."""
    if degree == 1:
        return np.stack([1.0 - s, s], axis=-1)
    return np.stack([(2.0 * s - 1.0) * (s - 1.0), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)], axis=-1)


def _weight(relative: Array, free: float) -> Array:
    """Weight of the penalty: a cubic from 1 at PENALISED_SHARE to 0 at `free` with zero slope at both."""
    s = np.clip((free - relative) / (free - PENALISED_SHARE), 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


def _chunks(nodes: Indices) -> list[Indices]:
    return np.array_split(nodes, len(nodes) // NODES_AT_ONCE + 1)


def _outer_sum(a, b):
    return (a[:, :, None] + b[:, None, :]).reshape(len(a), a.shape[1] * b.shape[1])


def _outer_product(a, b):
    return (a[:, :, None] * b[:, None, :]).reshape(len(a), a.shape[1] * b.shape[1])


def _outer_and(a, b):
    return (a[:, :, None] & b[:, None, :]).reshape(len(a), a.shape[1] * b.shape[1])
