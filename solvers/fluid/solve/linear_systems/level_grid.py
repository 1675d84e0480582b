"""The grids of geometric multigrid: products of planes, and nested cells on them.

A coarse lattice has some of the planes of the next finer one. Nested cells first lose their levels, the finest one
first: then the lattice of the coarsest cells is thinned out. Values between nodes are interpolated in the cell around
them, on nested cells with those of hanging nodes: the interpolation is continuous, and linear fields are exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from solvers.api import Array, Indices
from solvers.fluid.grid.box import Grid
from solvers.fluid.grid.nested import Nested
from solvers.fluid.solve.linear_systems.level_copies import Entries, LevelCopies, coarser_copies

#: A level has at most this share of the nodes of the next finer one.
THINNER = 0.6


@dataclass(frozen=True)
class LevelGrid:
    """Planes [m] per direction; along a periodic axis the last plane is the first."""

    planes: tuple[Array, ...]
    periodic: tuple[int, ...]
    nested: Nested | None = None  #: the cells, if not all are cells of the lattice
    copies: LevelCopies | None = None  #: of nodes around thin bodies

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(some) - (axis in self.periodic) for axis, some in enumerate(self.planes))

    @property
    def size(self) -> int:
        """Nodes of the lattice, without copies."""
        return int(np.prod(self.shape))

    @property
    def count(self) -> int:
        """Nodes with copies."""
        return self.size + (0 if self.copies is None else len(self.copies.further))

    def numbers(self, nodes: Indices) -> Indices:
        """Numbers of nodes, given the indices of their planes, shape (nodes, dim)."""
        return np.ravel_multi_index(tuple(nodes.T), self.shape, order="F").astype(np.int64)

    def indices(self, numbers: Indices) -> Indices:
        """Indices of the planes of nodes, given their numbers, shape (nodes, dim)."""
        places = numbers if self.copies is None else self.copies.places(numbers)
        return np.stack(np.unravel_index(places, self.shape, order="F"), axis=1)

    def points(self, nodes: Indices) -> Array:
        """Positions [m] of the same, shape (nodes, dim)."""
        return np.stack([some[i] for some, i in zip(self.planes, nodes.T, strict=True)], axis=1)

    def has(self, nodes: Indices) -> NDArray[np.bool_]:
        """Which nodes of the lattice are corners of all cells around them: the others do not exist, or hang."""
        if self.nested is None:
            return np.ones(len(nodes), dtype=bool)
        corners = self.nested.all_nodes(1)
        return np.isin(self.numbers(nodes), corners[~self.nested.hanging(1, corners)[0]])

    def coarser(self) -> LevelGrid:
        """The next coarser level: nested cells without their finest level, or pairs of the smallest neighbours merged.

        A pair is merged if the new cell is no wider than H, which is the same for all directions. Hence stretched cells
        are merged across their short edges first. H is doubled until at most the share THINNER of the nodes remains.
        """
        found = self._coarser()
        if self.copies is None:
            return found

        def interpolation(places: Indices) -> Entries:
            return found.interpolation(self.points(self.indices(places)))

        return replace(found, copies=coarser_copies(self.copies, interpolation, found.size))

    def _coarser(self) -> LevelGrid:
        if self.nested is not None:
            grid: Grid = self.nested.coarser()
            return LevelGrid(grid.edges, self.periodic, grid if isinstance(grid, Nested) else None)
        width = 2.0 * min(float(np.diff(some).min()) for some in self.planes)
        while True:
            found = LevelGrid(tuple(_join(some, width * (1.0 + 1e-6)) for some in self.planes), self.periodic)
            if found.smallest or np.prod(found.shape) <= THINNER * np.prod(self.shape):
                return found
            width *= 2.0

    @property
    def smallest(self) -> bool:
        """Whether it is a single cell."""
        return all(len(some) == 2 for some in self.planes)

    def interpolation(self, points: Array) -> tuple[Indices, Indices, Array]:
        """Entries of the matrix from values at nodes to values at points [m]: (points, numbers of nodes, weights)."""
        first = np.stack(
            [
                np.clip(np.searchsorted(some, x, side="right") - 1, 0, len(some) - 2)
                for some, x in zip(self.planes, points.T, strict=True)
            ],
            axis=1,
        )
        if self.nested is not None:
            return _nested_interpolation(self.nested, first, points)
        low, high = self.points(first), self.points(first + 1)
        steps = _steps(len(self.planes))
        nodes = (first[:, None] + steps) % np.array(self.shape)
        weights = _multilinear((points - low) / (high - low), steps)
        at, corner = np.nonzero(weights)
        return at, self.numbers(nodes[at, corner]), weights[at, corner]


def _nested_interpolation(grid: Nested, lattice_cells: Indices, points: Array) -> tuple[Indices, Indices, Array]:
    """The same for points in given cells of the lattice, from values at nodes that do not hang."""
    cells = grid.cell_of[np.ravel_multi_index(tuple(lattice_cells.T), grid.shape, order="F")].astype(np.int64)
    (low, high), steps, known = grid.bounds(cells), _steps(grid.dim), grid.all_nodes(1)
    weights = _multilinear((points - low) / (high - low), steps)
    corners = np.searchsorted(known, grid.nodes(cells, 1, steps))
    at = np.repeat(np.arange(len(points)), len(steps))
    in_cells = sparse.csr_matrix((weights.ravel(), (at, corners.ravel())), shape=(len(points), len(known)))
    hangs, masters, shares = grid.hanging(1, known)
    rows = np.repeat(np.flatnonzero(hangs), shares.shape[1])
    free = np.flatnonzero(~hangs)
    entries = (
        np.concatenate([np.ones(len(free)), shares.ravel()]),
        (np.concatenate([free, rows]), np.concatenate([free, np.searchsorted(known, masters.ravel())])),
    )
    found = in_cells @ sparse.csr_matrix(entries, shape=(len(known),) * 2)
    found.eliminate_zeros()
    found = found.tocoo()
    return found.row, known[found.col], found.data


def _steps(dim: int) -> Indices:
    return np.array(list(product((0, 1), repeat=dim)))


def _multilinear(at: Array, steps: Indices) -> Array:
    """Shape functions of the corners of unit cells, shape (points, corners)."""
    weights: Array = np.where(steps, at[:, None], 1.0 - at[:, None]).prod(axis=2)
    return weights


def _join(planes: Array, width: float) -> Array:
    kept, i = [0], 0
    while i < len(planes) - 1:
        i += 2 if i + 2 < len(planes) and planes[i + 2] - planes[i] <= width else 1
        kept.append(i)
    return planes[kept]
