"""Values at the nodes around thin bodies, after these have moved, from those before: each side from its own.

A side is identified by the facets that it wets, which move with the body (docs/theory_fluid.md, Thin bodies in motion).
So nothing goes from one side to the other, whatever the thickness of the body.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from solvers.api import Array, Indices
from solvers.fluid.cut.extension import FREE_SHARE, LARGEST_FACTOR, continued, lagrange
from solvers.fluid.geometry.thin.fluid_parts import LAYERS_AROUND, join
from solvers.fluid.geometry.thin.sheet_windows import neighbours_of
from solvers.fluid.geometry.thin.sheets import Sheets

#: Facets whose distances along the surface are computed together, to bound the memory.
SHEET_FACETS_AT_ONCE = 1024

#: How much more a facet counts than one that is a cell farther away along the fluid.
NEARER = 8
#: Cosine between facets seen from two places, weighted so, from which on these are on the same side.
SAME_SIDE = 0.05


@dataclass(frozen=True)
class Sides:
    """Cells with fluid, their nodes of one degree, and the facets that each can see."""

    sheets: Sheets
    degree: int
    cells: Indices  #: with fluid
    nodes: Indices  #: of these, shape (cells, nodes), the first direction slowest
    of_cells: sparse.csr_matrix  #: unit vectors, shape (cells of the mesh, facets)
    of_nodes: sparse.csr_matrix  #: the same of nodes by their numbers

    @property
    def wet(self) -> NDArray[np.bool_]:
        """Nodes with fluid around them."""
        found = np.zeros(self.sheets.node_count(self.degree), dtype=bool)
        found[self.nodes] = True
        return found


def along_surface(facets: Indices, x: Array, distance: float) -> sparse.csr_matrix:
    """1 for facets with at most this distance [m] along the surface between their middles, shape (facets, facets)."""
    dim, count = facets.shape[1], len(facets)
    entries = (np.ones(facets.size), (np.repeat(np.arange(count), dim), facets.ravel()))
    corners = sparse.csr_matrix(entries, shape=(count, len(x)))
    common = sparse.triu(corners @ corners.T, 1).tocoo()  # how many corners
    one, other = common.row[common.data == dim - 1], common.col[common.data == dim - 1]
    if dim == 2:
        length = np.linalg.norm(x[facets[:, 1]] - x[facets[:, 0]], axis=1)
        way = 0.5 * (length[one] + length[other])
    else:
        middle = x[facets].mean(axis=1)
        way = np.linalg.norm(middle[one] - middle[other], axis=1)
    graph = sparse.csr_matrix((way, (one, other)), shape=(count, count))
    rows = [
        sparse.csr_matrix(dijkstra(graph, directed=False, indices=some, limit=distance) < np.inf, dtype=float)
        for some in np.array_split(np.arange(count), count // SHEET_FACETS_AT_ONCE + 1)
    ]
    return sparse.csr_matrix(sparse.vstack(rows))


def transfer(before: Sides, after: Sides) -> sparse.csr_matrix:
    """Values at the nodes of new sheets are this matrix times those of the old ones; rows without entries: unknown.

    Nodes of one degree, by their numbers in the sheets.
    """
    old, new, degree = before.sheets, after.sheets, after.degree
    numbers = np.flatnonzero(after.wet)
    places = new.on_lattice(numbers, degree)
    near = _near(old, degree) | _near(new, degree)
    size, width = old.node_count(degree), new.node_count(degree)
    kept = numbers[~near[places]]
    numbers, places = numbers[near[places]], places[near[places]]
    # nodes of the old sheets in the same places
    wet = np.flatnonzero(before.wet)
    at, candidate = join(places, wet, old.on_lattice(wet, degree))
    seen = np.diff(after.of_nodes.indptr)[numbers] > 0
    was_seen = np.diff(before.of_nodes.indptr)[candidate] > 0
    alike = _dot(after.of_nodes[numbers[at]], before.of_nodes[candidate])
    alike[~(seen[at] & was_seen)] = SAME_SIDE  # one of them is far from all surfaces
    best = np.full(len(numbers), -1.0)
    np.maximum.at(best, at, alike)
    chosen = (alike == best[at]) & (alike >= SAME_SIDE)
    at, first = np.unique(at[chosen], return_index=True)
    rows, columns = np.concatenate([kept, numbers[at]]), np.concatenate([kept, candidate[chosen][first]])
    direct = sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(width, size))
    rest = np.setdiff1d(np.arange(len(numbers)), at)
    return (direct + _continued_to(before, after.of_nodes[numbers[rest]], numbers[rest], places[rest], width)).tocsr()


def sides_of(sheets: Sheets, degree: int, along: sparse.csr_matrix) -> Sides:
    """Sides of bodies around the nodes of this degree; along: `along_surface` with the length of a cell."""
    steps = np.array(list(product(range(degree + 1), repeat=sheets.grid.dim)))
    adjacent = neighbours_of(sheets)
    fluid = np.zeros(sheets.size, dtype=bool)
    fluid[: sheets.grid.size] = ~sheets.around
    fluid[sheets.links] = True
    cells = np.flatnonzero(fluid)
    nodes = sheets.nodes(cells, degree, steps)
    ones = np.ones(len(sheets.bounds))
    reached = sparse.csr_matrix((ones, tuple(sheets.bounds.T)), shape=(sheets.size, along.shape[0])).sign()
    seen = reached
    # a place three cells away may see one facet before a step and the next one after it
    reached = (reached @ along).sign()
    seen = NEARER * seen + reached
    for _ in range(LAYERS_AROUND):
        reached = (reached + adjacent @ reached).sign()
        seen = NEARER * seen + reached
    entries = (nodes.ravel(), np.repeat(cells, nodes.shape[1]))
    shape = (sheets.node_count(degree), sheets.size)
    around = sparse.csr_matrix((np.ones(len(entries[0])), entries), shape=shape)
    return Sides(sheets, degree, cells, nodes, _unit(seen), _unit(around @ seen))


def _unit(rows: sparse.csr_matrix) -> sparse.csr_matrix:
    """Rows of unit length, or without entries."""
    rows = rows.tocsr()
    rows.eliminate_zeros()
    length = np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).ravel())
    return sparse.diags(1.0 / np.where(length > 0.0, length, 1.0)) @ rows


def _near(sheets: Sheets, degree: int) -> NDArray[np.bool_]:
    """Places of the lattice that cells near surfaces have."""
    steps = np.array(list(product(range(degree + 1), repeat=sheets.grid.dim)))
    found = np.zeros(sheets.lattice_size(degree), dtype=bool)
    found[sheets.on_lattice(sheets.nodes(np.flatnonzero(sheets.around), degree, steps), degree)] = True
    return found


def _dot(a: sparse.csr_matrix, b: sparse.csr_matrix) -> Array:
    return np.asarray(a.multiply(b).sum(axis=1)).ravel()


def _continued_to(
    sides: Sides, seen: sparse.csr_matrix, numbers: Indices, places: Indices, rows: int
) -> sparse.csr_matrix:
    """Rows for nodes by the polynomial of that well-cut cell of their side which amplifies least."""
    sheets, degree, grid = sides.sheets, sides.degree, sides.sheets.grid
    shape = (rows, sheets.node_count(degree))
    if not len(numbers):
        return sparse.csr_matrix(shape)
    index = np.stack(np.unravel_index(places, sheets.lattice_shape(degree), order="F"), axis=1)
    window = np.array(list(product(range(-LAYERS_AROUND - 1, LAYERS_AROUND + 1), repeat=grid.dim)))
    cells = (index // degree)[:, None, :] + window
    inside = ((cells >= 0) & (cells < grid.shape)).all(axis=2)
    at, which = np.nonzero(inside)
    box = np.ravel_multi_index(tuple(cells[at, which].T), grid.shape, order="F")
    pair, cell = join(box, sides.cells, sheets.box_cells(sides.cells))
    at = at[pair]
    alike = _dot(seen[at], sides.of_cells[cell])
    best = np.zeros(len(numbers))
    np.maximum.at(best, at, alike)
    own = (alike >= SAME_SIDE) & (alike >= 0.5 * best[at])
    at, cell = at[own], cell[own]
    fullest = np.zeros(len(numbers))
    np.maximum.at(fullest, at, sheets.fluid[cell])
    well = (sheets.fluid[cell] >= FREE_SHARE[grid.dim] * fullest[at]) & (sheets.fluid[cell] > 0.0)
    at, cell = at[well], cell[well]
    of_box = np.stack(np.unravel_index(sheets.box_cells(cell), grid.shape, order="F"), axis=1)
    local = np.empty((len(at), grid.dim))
    for axis, edge in enumerate(grid.edges):
        x = np.interp(index[at, axis] / degree, np.arange(len(edge)), edge)
        low, high = edge[of_box[:, axis]], edge[of_box[:, axis] + 1]
        local[:, axis] = (x - low) / (high - low)
    cost = np.abs(lagrange(local, degree)).sum(axis=2).prod(axis=1)
    order = np.lexsort((cell, cost, at))
    chosen = order[np.unique(at[order], return_index=True)[1]]
    at, steep = at[chosen], cost[chosen] > LARGEST_FACTOR
    weights = reduce(_outer, (continued(local[chosen, axis], degree, steep) for axis in range(grid.dim)))
    steps = np.array(list(product(range(degree + 1), repeat=grid.dim)))
    columns = sheets.nodes(cell[chosen], degree, steps)
    of_rows = np.repeat(numbers[at], columns.shape[1])
    return sparse.csr_matrix((weights.ravel(), (of_rows, columns.ravel())), shape=shape)


def _outer(a: Array, b: Array) -> Array:
    return (a[:, :, None] * b[:, None, :]).reshape(len(a), a.shape[1] * b.shape[1])
