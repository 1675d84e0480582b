"""Copies of nodes around thin bodies: which parts of the fluid share a node."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from solvers.algebra.connected import connected_parts
from solvers.api import Indices, Mask
from solvers.fluid.geometry.thin.fluid_parts import FluidParts
from solvers.fluid.grid.box import Grid

Joined = Mapping[int, frozenset[int]]  #: for cells of the box, facets whose parts of fluid are joined


def same_nodes(parts: FluidParts, joined: Joined) -> list[tuple[int, int]]:
    """Pairs of parts that are joined."""
    found = []
    for cell, facets in joined.items():
        here = range(*np.searchsorted(parts.cell, [cell, cell + 1]).tolist())
        first, *others = [number for number in here if facets & parts.facets(number)] or [-1]
        found += [(first, number) for number in others]
    return found


def node_copies(
    grid: Grid,
    cells: Indices,
    links: Indices,
    same: Sequence[tuple[int, int]],
    special: Mask,
) -> Indices:
    """Number of the copy that each node of a part's cell is, in the lattice of second degree, shape (parts, nodes).

    cells: of the parts; links: (part, part of the next cell, axis); same: pairs of parts of a cell with the same nodes.
    Of the connected sets of parts around a node, that of the most parts keeps the node of the box, copy 0; of equal
    ones, that of the first part. So the numbers depend on what is connected, not on how much fluid is on each side:
    where the sides are alike, iterates would exchange them, and each exchange would be taken for other unknowns.
    """
    steps = np.array(list(product(range(3), repeat=grid.dim)))[:, ::-1]  # the first direction fastest
    size = len(steps)
    one, other = np.array(same, dtype=np.int64).reshape(-1, 2).T
    nodes = np.arange(size)
    first, second = [(one[:, None] * size + nodes).ravel()], [(other[:, None] * size + nodes).ravel()]
    for axis in range(grid.dim):
        a, b, _ = links[links[:, 2] == axis].T
        upper, lower = (np.flatnonzero(steps[:, axis] == at) for at in (2, 0))
        first.append((a[:, None] * size + upper).ravel())
        second.append((b[:, None] * size + lower).ravel())
    group = connected_parts(np.concatenate(first), np.concatenate(second), len(cells) * size)
    index = np.stack(np.unravel_index(cells, grid.shape, order="F"), axis=1)
    counts = [2 * n + 1 for n in grid.shape]
    node = np.ravel_multi_index(tuple(np.moveaxis(2 * index[:, None] + steps, 2, 0)), counts, order="F").ravel()
    groups, members = np.unique(group, return_counts=True)
    order = groups[np.lexsort((groups, -members, node[groups]))]
    starts = np.flatnonzero(np.diff(node[order], prepend=-1))
    rank = np.zeros(len(group), dtype=np.int64)
    rank[order] = np.arange(len(order)) - np.repeat(starts, np.diff(starts, append=len(order)))
    around = np.zeros(int(np.prod(counts)), dtype=bool)  # all cells around these nodes are among the parts
    near = np.stack(np.unravel_index(np.flatnonzero(special), grid.shape, order="F"), axis=1)
    around[np.ravel_multi_index(tuple(np.moveaxis(2 * near[:, None] + steps, 2, 0)), counts, order="F")] = True
    return np.where(around[node], rank[group], 0).reshape(-1, size)
