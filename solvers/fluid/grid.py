"""The background grid: a box of axis-aligned cells, distributed, with its cells and faces in box numbering."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.mesh import Mesh

#: Names of the box faces: axis and side.
FACES = ("x-", "x+", "y-", "y+", "z-", "z+")

Indices = NDArray[np.int64]


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


class DistributedGrid:
    """The part of the grid that this process holds: its cells, one layer of ghost cells, and their faces."""

    def __init__(self, comm: MPI.Comm, grid: Grid):
        self.comm, self.grid = comm, grid
        self.domain = fem.distribute(comm, grid.mesh() if comm.rank == 0 else None)
        #: box number of each local cell, ghosts last
        self.numbers: Indices = fem.input_cells(self.domain)
        self.owned = fem.owned_cells(self.domain)
        self.sizes = grid.cell_sizes()[self.numbers]
        self._seams: dict[tuple[int, ...], tuple[Indices, Indices]] = {}

    @property
    def dim(self) -> int:
        return self.grid.dim

    @cached_property
    def interior_faces(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """(local faces, their two local cells) of all faces between two local cells."""
        return fem.interior_facets(self.domain)

    @cached_property
    def outer_faces(self) -> tuple[NDArray[np.int32], NDArray[np.int32], Array]:
        """(local faces, their cells, midpoints of shape (faces, dim)) on the box's boundary that this process knows."""
        faces, cells = fem.boundary_facets(self.domain)
        return faces, cells, fem.facet_midpoints(self.domain, faces)

    @cached_property
    def window(self) -> tuple[Indices, tuple[int, ...], Indices]:
        """Lowest index and shape of the smallest box around the owned cells; their places in it, last axis fastest."""
        index = np.stack(np.unravel_index(self.numbers[: self.owned], self.grid.shape, order="F"))
        low = index.min(axis=1, initial=np.iinfo(np.int64).max) if self.owned else np.zeros(self.dim, dtype=np.int64)
        shape = tuple((index.max(axis=1) - low + 1).tolist()) if self.owned else (0,) * self.dim
        return low, shape, np.ravel_multi_index(tuple(index - low[:, None]), shape) if self.owned else np.empty(0, int)

    def seams(self, periodic: tuple[int, ...] = ()) -> tuple[Indices, Indices]:
        """(owned cells, numbers of corners) where these meet cells of others, or cells across a period.

        Corners are numbered as in the lattice of all corners, those of a `periodic` axis's end as those of its start.
        """
        if periodic not in self._seams:
            self._seams[periodic] = self._find_seams(periodic)
        return self._seams[periodic]

    def _find_seams(self, periodic: tuple[int, ...]) -> tuple[Indices, Indices]:
        shape = self.grid.shape
        lattice = [n if axis in periodic else n + 1 for axis, n in enumerate(shape)]
        index = np.stack(np.unravel_index(self.numbers[: self.owned], shape, order="F"))
        cells, numbers, across = [], [], []
        for side in np.ndindex((2,) * self.dim):
            corner = (index + np.array(side)[:, None]) % np.array(lattice)[:, None]
            cells.append(np.arange(self.owned, dtype=np.int64))
            numbers.append(np.ravel_multi_index(tuple(corner), lattice, order="F"))
            across.append((corner[list(periodic)] == 0).any(axis=0))
        cell, number, crossing = (np.concatenate(found) for found in (cells, numbers, across))
        meeting = np.bincount(number, minlength=int(np.prod(lattice)))
        around = [np.full(n, 2) for n in lattice]
        for axis, cells_there in enumerate(around):
            if axis not in periodic:
                cells_there[[0, -1]] = 1
        whole = np.ones(lattice, dtype=np.int64)
        for axis, cells_there in enumerate(around):
            whole *= cells_there.reshape([-1 if a == axis else 1 for a in range(self.dim)])
        seam = crossing | (meeting < whole.ravel(order="F"))[number]
        return cell[seam], number[seam]

    def on_face(self, midpoints: Array, name: str) -> NDArray[np.bool_]:
        """Which midpoints lie on a box face such as 'x-'."""
        axis = "xyz".index(name[0])
        edge = self.grid.edges[axis]
        plane = edge[0] if name[1] == "-" else edge[-1]
        return np.abs(midpoints[:, axis] - plane) < 1e-9 * (edge[-1] - edge[0])


def uniform(low: Sequence[float], high: Sequence[float], cells: Sequence[int]) -> Grid:
    """A grid of equal cells."""
    return Grid(tuple(np.linspace(a, b, n + 1) for a, b, n in zip(low, high, cells, strict=True)))
