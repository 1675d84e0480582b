"""Nodes of multigrid's levels around thin bodies: a coarse node has one copy for each side of a body in its support.

The support of a coarse node J is the set of finer nodes i with phi_J(x_i) > 0. Two of these are on the same side if a
path of cells with fluid, with nodes of the support alone, leads from one to the other. Each finer node is interpolated
from copies on its own side, so that coarse corrections do not pass through bodies, whatever the width of coarse cells.
A side without a finer node in the place of J has no copy: then all columns of the interpolation are independent, also
around slivers of fluid with fewer finer nodes than coarse ones. Its weight is divided among the others.
Source: the rule for nodes of Schott, Wall, Comput. Methods Appl. Mech. Engrg. 276 (2014) 233-265, section 3, on levels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from solvers.api import Array, Indices, Mask
from solvers.fluid.geometry.thin.fluid_parts import ragged
from solvers.fluid.geometry.thin.sheets import Sheets
from solvers.fluid.grid.nested import Nested

#: Entries of an interpolation: (finer nodes, places in the coarse lattice, weights).
Entries = tuple[Indices, Indices, Array]


@dataclass(frozen=True)
class LevelCopies:
    """Copies of nodes on one level: nodes of the lattice come first, further ones follow."""

    size: int  #: of the lattice
    further: Indices  #: number in the lattice of each further node
    #: 1 where a node belongs to a cell with fluid, shape (cells, nodes); where bodies are far, one of many alike cells
    cells: sparse.csr_matrix
    parted: Mask  #: nodes in whose support not all cells are whole cells of the lattice with fluid
    #: finer node * size + place of each interpolation to another node than that of the lattice, sorted, and this node;
    #: -1: there is none
    keys: Indices
    numbers: Indices

    def places(self, numbers: Indices) -> Indices:
        """Number in the lattice of each of some nodes."""
        found = numbers.copy()
        further = numbers >= self.size
        found[further] = self.further[numbers[further] - self.size]
        return found

    def parents(self, finer: Indices, places: Indices, weights: Array) -> Entries:
        """Entries to nodes of this level, from those to places in its lattice; constant values stay exact."""
        rows = np.unique(self.keys // self.size)  # all other nodes are interpolated from those of the lattice
        row = np.searchsorted(rows, finer)
        at_rows = np.flatnonzero(np.append(rows, -1)[row] == finer)
        keys = finer[at_rows] * self.size + places[at_rows]
        at = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        parents, weights = places.copy(), weights.copy()
        parents[at_rows] = np.where(self.keys[at] == keys, self.numbers[at], places[at_rows])
        some = parents >= 0
        at_rows = at_rows[some[at_rows]]
        weights[at_rows] /= np.bincount(row[at_rows], weights[at_rows], len(rows))[row[at_rows]]
        return finer[some], parents[some], weights[some]

    @property
    def lowest(self) -> Indices:
        """The lowest of the finer nodes that are interpolated from each further node."""
        found = np.full(len(self.further), np.iinfo(np.int64).max)
        some = self.numbers >= 0
        np.minimum.at(found, self.numbers[some] - self.size, self.keys[some] // self.size)
        return found


def vertices(sheets: Sheets, nested: Nested | None) -> LevelCopies:
    """Copies of the vertices of a mesh with sheets; each is interpolated to itself alone."""
    steps = np.array(list(product((0, 1), repeat=sheets.grid.dim)))
    fluid, whole = _with_fluid(sheets), np.ones(sheets.grid.size, dtype=bool)
    whole[list(sheets.successors)] = False
    whole &= fluid[: sheets.grid.size]
    size, count = sheets.lattice_size(1), sheets.node_count(1)
    parted = np.zeros(count, dtype=bool)
    parted[size:] = True
    parted[sheets.nodes(np.flatnonzero(~whole), 1, steps)] = True
    cells = np.flatnonzero(fluid)
    if nested is None:
        nodes = sheets.nodes(cells, 1, steps)
    else:  # all cells near surfaces are of the finest level
        coarse = (cells < sheets.grid.size) & nested.coarse[np.minimum(cells, sheets.grid.size - 1)]
        wide = np.unique(nested.cell_of[cells[coarse]]).astype(np.int64)
        nodes = np.concatenate([sheets.nodes(cells[~coarse], 1, steps), nested.nodes(wide, 1, steps)])
    further = np.arange(size, count)
    places = sheets.on_lattice(further, 1)
    order = np.argsort(further * size + places)
    return LevelCopies(size, places, _incidence(nodes, count), parted, (further * size + places)[order], further[order])


def second_degree(sheets: Sheets) -> LevelCopies:
    """Copies of the nodes of second degree."""
    size, count, none = sheets.lattice_size(2), sheets.node_count(2), np.zeros(0, dtype=np.int64)
    further = sheets.on_lattice(np.arange(size, count), 2)
    return LevelCopies(size, further, sparse.csr_matrix((0, count)), np.zeros(count, dtype=bool), none, none)


def from_second_degree(sheets: Sheets, corners: LevelCopies) -> LevelCopies:
    """Copies of vertices, from which nodes of second degree are interpolated, each from those of its cells."""
    dim = sheets.grid.dim
    steps, inner = (np.array(list(product(range(degree + 1), repeat=dim))) for degree in (1, 2))
    cells = np.flatnonzero(_with_fluid(sheets) & (np.arange(sheets.size) >= sheets.grid.size))
    node, corner = np.nonzero((np.abs(inner[:, None] - 2 * steps) < 2).all(axis=2))  # with a positive weight
    finer, number = sheets.nodes(cells, 2, inner)[:, node].ravel(), sheets.nodes(cells, 1, steps)[:, corner].ravel()
    some = number >= corners.size
    keys, at = np.unique(finer[some] * corners.size + corners.places(number[some]), return_index=True)
    return replace(corners, keys=keys, numbers=number[some][at])


def coarser_copies(fine: LevelCopies, interpolation: Callable[[Indices], Entries], size: int) -> LevelCopies:
    """Copies on the next coarser level; nodes without fluid, as most of nested cells' lattice, are not looked at.

    interpolation: entries from nodes of its lattice, which has `size`, to places in that of the finer level.
    """
    nodes, column = np.unique(fine.cells.indices, return_inverse=True)
    nodes = nodes.astype(np.int64)
    cells = sparse.csr_matrix((fine.cells.data, column, fine.cells.indptr), shape=(fine.cells.shape[0], len(nodes)))
    finer, places, weights = interpolation(fine.places(nodes))
    supports = sparse.csr_matrix((weights, (finer, places)), shape=(len(nodes), size))
    concerned = np.zeros(size, dtype=bool)
    concerned[supports[fine.parted[nodes]].indices] = True
    kept = supports.tocoo()
    some = concerned[kept.col]
    node, place, weight = kept.row[some].astype(np.int64), kept.col[some].astype(np.int64), kept.data[some]
    side = _sides(cells, node, place, size)
    # of the sides in a place, that with the most fluid keeps the node of the lattice, first those with a node there
    sides, where = np.unique(side, return_index=True)
    of_side = place[where]
    there = np.zeros(len(sides), dtype=bool)
    there[side[weight == 1.0]] = True
    order = np.lexsort((where, -np.bincount(side, weight, len(sides)), ~there, of_side))
    first = np.diff(of_side[order], prepend=-1) > 0
    copied = ~first & there[order]
    number = np.full(len(sides), -1)
    number[order[first]], number[order[copied]] = of_side[order][first], size + np.arange(np.count_nonzero(copied))
    further = of_side[order][copied]
    own = number[side] != place
    order = np.argsort(keys := nodes[node[own]] * size + place[own])
    found = LevelCopies(
        size, further, sparse.csr_matrix((0, 0)), np.concatenate([concerned, np.ones(len(further), dtype=bool)]),
        keys[order], number[side][own][order],
    )  # fmt: skip
    finer, parents, weights = found.parents(nodes[kept.row], kept.col.astype(np.int64), kept.data)
    entries = (weights, (np.searchsorted(nodes, finer), parents))
    return replace(found, cells=_different(cells @ sparse.csr_matrix(entries, shape=(len(nodes), size + len(further)))))


def _sides(cells: sparse.csr_matrix, node: Indices, place: Indices, size: int) -> Indices:
    """Numbers from 0 of the sides of pairs of a finer node and a place that has it in its support, sorted by nodes.

    cells: 1 where a node belongs to a cell.
    """
    start = np.searchsorted(node, np.arange(cells.shape[1] + 1))
    inside = cells.tocoo()
    row, at = ragged(np.diff(start)[inside.col])
    pair = start[inside.col][row] + at
    within = np.unique(inside.row[row] * np.int64(size) + place[pair], return_inverse=True)[1]
    total = len(node) + int(within.max(initial=-1)) + 1
    graph = sparse.coo_matrix((np.ones(len(pair)), (pair, len(node) + within)), shape=(total, total))
    labels = connected_components(graph, directed=False)[1][: len(node)]
    return np.unique(labels, return_inverse=True)[1]


def _with_fluid(sheets: Sheets) -> Mask:
    """Cells of the mesh with fluid that others share; faces between cells have further cells without any."""
    found = np.zeros(sheets.size, dtype=bool)
    found[: sheets.grid.size] = ~sheets.around
    found[sheets.links] = True
    return found & (sheets.fluid > 0.0)


def _incidence(nodes: Indices, count: int) -> sparse.csr_matrix:
    rows = np.repeat(np.arange(len(nodes)), nodes.shape[1])
    return sparse.csr_matrix((np.ones(nodes.size), (rows, nodes.ravel())), shape=(len(nodes), count))


def _different(rows: sparse.csr_matrix) -> sparse.csr_matrix:
    """Those rows whose entries are in different columns."""
    rows.sort_indices()
    lengths = np.diff(rows.indptr)
    table = np.full((len(lengths), int(lengths.max(initial=1))), -1, dtype=np.int64)
    row, at = ragged(lengths)
    table[row, at] = rows.indices
    table = np.unique(table, axis=0)
    row, at = np.nonzero(table >= 0)
    entries = (np.ones(len(row)), (row, table[row, at]))
    return sparse.csr_matrix(entries, shape=(len(table), rows.shape[1]))
