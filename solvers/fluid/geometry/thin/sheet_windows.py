"""Cells near a node on its own side of thin bodies: candidates for the root of its extension.

A cell is near if a path of cells leads from the node to it through faces with fluid on both sides, and every step of
the path increases the distance from the node. No such path leads around a thin body, not even around its tip.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from solvers.api import Indices
from solvers.fluid.geometry.thin.sheets import Sheets


class SheetWindows:
    """Windows of cells around nodes of one degree on a grid with sheets; nodes are given as indices into `numbers`."""

    def __init__(self, sheets: Sheets, degree: int, numbers: Indices):
        grid = sheets.grid
        self._sheets, self._degree, self._count = sheets, degree, len(numbers)
        #: first direction slowest
        self._steps = np.array(list(product(range(degree + 1), repeat=grid.dim)))
        place = sheets.box_cells(np.arange(sheets.size))
        self._index = np.stack(np.unravel_index(place, grid.shape, order="F"), axis=1)
        self._neighbours = neighbours_of(sheets)
        self._fluid = sheets.fluid
        fluid = np.zeros(sheets.size, dtype=bool)  # pairs of cells for faces have no fluid
        fluid[: grid.size] = ~sheets.around
        fluid[sheets.links] = True
        cells = np.flatnonzero(fluid)
        nodes = self.nodes(cells)
        position = np.full(sheets.node_count(degree), -1)
        position[numbers] = np.arange(len(numbers))
        given = position[nodes] >= 0
        entries = (position[nodes[given]], np.repeat(cells, given.sum(axis=1)))
        #: cells with fluid of each node
        self._own = sparse.csr_matrix((np.ones(len(entries[0])), entries), shape=(len(numbers), sheets.size))
        self._tables: dict[int, Indices] = {}  #: cells of the windows by layers, -1: none, -2: not computed yet
        #: by layers, nodes from which several copies of a cell are reached: only their windows depend on the fluid
        self._contested: dict[int, NDArray[np.bool_]] = {}

    def follow(self, sheets: Sheets) -> None:
        """Take sheets with the same cells, of which some have more fluid now and others less."""
        if sheets is not self._sheets:
            self._sheets, self._fluid = sheets, sheets.fluid
            for layers, contested in self._contested.items():
                self._tables[layers][contested] = -2

    def nodes(self, cells: Indices) -> Indices:
        """Numbers of the nodes of cells of the mesh, the first direction slowest, shape (cells, nodes)."""
        return self._sheets.nodes(cells, self._degree, self._steps)

    def cells_around(self, nodes: Indices, index: Indices, layers: int) -> tuple[Indices, NDArray[np.bool_]]:
        """(cells, whether they exist) around nodes, shape (nodes, cells); index: of the nodes in the lattice."""
        width = 2 * layers + 2
        if layers not in self._tables:
            self._tables[layers] = np.full((self._count, width**self._sheets.grid.dim), -2)
            self._contested[layers] = np.zeros(self._count, dtype=bool)
        table = self._tables[layers]
        some, first = np.unique(nodes, return_index=True)
        new = table[some, 0] == -2
        if new.any():
            table[some[new]] = self._search(some[new], index[first[new]] // self._degree - layers - 1, layers)
        found = table[nodes]
        return np.maximum(found, 0), found >= 0

    def _search(self, nodes: Indices, corner: Indices, layers: int) -> Indices:
        """The windows of nodes; `corner`: indices of their first cells."""
        dim, width = self._sheets.grid.dim, 2 * layers + 2
        reached = self._own[nodes]
        first, last = np.full((len(nodes), dim), np.iinfo(np.int64).max), np.full((len(nodes), dim), -1)
        row, cell = reached.nonzero()
        np.minimum.at(first, row, self._index[cell])
        np.maximum.at(last, row, self._index[cell])
        found = np.full((len(nodes), width**dim), -1)
        for distance in range(dim * layers + 1):
            if distance:
                row, cell = (reached @ self._neighbours).nonzero()
                at = self._index[cell]
                away = np.maximum(0, np.maximum(first[row] - at, at - last[row]))
                kept = (away.sum(axis=1) == distance) & (away.max(axis=1) <= layers)
                row, cell = row[kept], cell[kept]
                reached = sparse.csr_matrix((np.ones(len(row)), (row, cell)), shape=reached.shape)
            place = (self._index[cell] - corner[row]) @ width ** np.arange(dim)[::-1]
            order = np.argsort(self._fluid[cell], kind="stable")  # of several copies the one with the most fluid
            found[row[order], place[order]] = cell[order]
            self._contested[layers][nodes[row[found[row, place] != cell]]] = True
        return found


def neighbours_of(sheets: Sheets) -> sparse.csr_matrix:
    """Adjacency of cells of the mesh by faces with fluid on both sides; away from surfaces by all faces of the box."""
    grid = sheets.grid
    number = grid.as_box(np.arange(grid.size))
    pairs = [sheets.links]
    for axis in range(grid.dim):
        low, high = (number.take(np.arange(grid.shape[axis] - 1) + side, axis).ravel() for side in (0, 1))
        apart = ~(sheets.around[low] & sheets.around[high])
        pairs.append(np.stack([low[apart], high[apart]], axis=1))
    low, high = np.concatenate(pairs).T
    ends = (np.concatenate([low, high]), np.concatenate([high, low]))
    return sparse.csr_matrix((np.ones(len(ends[0])), ends), shape=(sheets.size, sheets.size))
