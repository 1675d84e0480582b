"""The background grid: a box of axis-aligned cells in lexicographic numbering."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.mesh.mesh import Mesh

#: Distance from a plane of the grid, in cells, up to which something lies in it.
FLUSH = 1e-6
#: Names of the box faces: axis and side.
FACES = ("x-", "x+", "y-", "y+", "z-", "z+")
#: Steps from the first corner of a cell to each corner, in the order of `Grid.mesh`.
SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]
CORNER_STEPS = {2: np.array(SQUARE), 3: np.array([[*xy, z] for z in (0, 1) for xy in SQUARE])}


@dataclass(frozen=True)
class Grid:
    """Cells between the planes x = edges[0][i], y = edges[1][j], z = edges[2][k]; cell number i + nx (j + ny k)."""

    edges: tuple[Array, ...]  #: increasing coordinates [m] of the grid planes, one array per direction

    @property
    def dim(self) -> int:
        return len(self.edges)

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells per direction."""
        return tuple(len(edge) - 1 for edge in self.edges)

    @property
    def size(self) -> int:
        """Number of cells."""
        return int(np.prod(self.shape))

    def mesh(self) -> Mesh:
        """Nodes and cells of the whole box."""
        lattice = np.meshgrid(*self.edges, indexing="ij")
        points = np.stack([x.ravel(order="F") for x in lattice], axis=1)
        strides = np.cumprod([1, *(n + 1 for n in self.shape)])[: self.dim]
        first = sum(
            index.ravel(order="F") * stride for index, stride in zip(np.indices(self.shape), strides, strict=True)
        )
        square = np.array([0, strides[0], strides[0] + strides[1], strides[1]])
        corners = square if self.dim == 2 else np.concatenate([square, square + strides[2]])
        return Mesh(points, first[:, None] + corners, "quad" if self.dim == 2 else "hexahedron")

    def cell_sizes(self) -> Array:
        """Edge lengths [m] of every cell, shape (size, dim)."""
        steps = np.meshgrid(*(np.diff(edge) for edge in self.edges), indexing="ij")
        return np.stack([h.ravel(order="F") for h in steps], axis=1)

    def as_box(self, values: NDArray) -> NDArray:
        """Values per cell as an array with one axis per direction (a view)."""
        return values.reshape(self.shape, order="F")


def uniform(low: Sequence[float], high: Sequence[float], cells: Sequence[int]) -> Grid:
    """A grid of equal cells."""
    return Grid(tuple(np.linspace(a, b, n + 1) for a, b, n in zip(low, high, cells, strict=True)))
