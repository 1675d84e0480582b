"""The distributed background grid, with its cells and faces in the numbering of the box."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array, Indices
from solvers.fluid.geometry.thin.sheets import Sheets
from solvers.fluid.grid.box import Grid
from solvers.fluid.grid.nested import Nested


class DistributedGrid:
    """The part of the grid that this process holds: its cells, one layer of ghost cells, and their faces."""

    def __init__(
        self, comm: MPI.Comm, grid: Grid, sheets: Sheets | None = None, destinations: fem.Destinations | None = None
    ):
        """destinations: processes of the cells of a box; None: by their graph (collective)."""
        self.comm, self.grid, self.sheets = comm, grid, sheets
        self.nested = grid if isinstance(grid, Nested) else None
        mesh = (grid.mesh() if sheets is None else sheets.mesh(grid)) if comm.rank == 0 else None
        self.domain = fem.distribute(comm, mesh, axis_aligned=True, destinations=destinations)
        #: number of each local cell in the mesh, ghosts last
        self.original: Indices = fem.input_cells(self.domain)
        #: the same with the number in the box, of a coarser cell that of its lowest one; those of `sheets` follow
        self.in_sheets: Indices = self.original if self.nested is None else self.nested.lattice_numbers(self.original)
        #: number in the box of each local cell. Only with `sheets` several cells have the same number
        self.numbers: Indices = self.in_sheets if sheets is None else sheets.box_cells(self.in_sheets)
        self.owned = fem.owned_cells(self.domain)
        #: edge lengths [m] of the local cells, shape (cells, dim)
        self.sizes = grid.cell_sizes()[self.numbers] if self.nested is None else self._nested_sizes()
        self._interior_faces: tuple[NDArray[np.int32], NDArray[np.int32]] | None = None
        self._seams: dict[tuple[int, ...], tuple[Indices, Indices]] = {}

    @property
    def dim(self) -> int:
        return self.grid.dim

    def _nested_sizes(self) -> Array:
        assert self.nested is not None
        low, high = self.nested.bounds(self.in_nested())
        return high - low

    def in_nested(self) -> Indices:
        """Number of each local cell in the nested grid; those of `sheets` have that of the cell in their place."""
        assert self.nested is not None
        return self.nested.cell_of[self.numbers].astype(np.int64)

    @property
    def in_box(self) -> NDArray[np.bool_]:
        """Mask of the cells of the box that the local cells cover."""
        if self.nested is None:
            covered = np.zeros(self.grid.size, dtype=bool)
            covered[self.numbers] = True
            return covered
        mine = np.zeros(len(self.nested.first), dtype=bool)
        mine[self.in_nested()] = True
        return mine[self.nested.cell_of]

    @property
    def joined(self) -> bool:
        """Whether some cells share nodes that are different vertices in the mesh."""
        return self.sheets is not None or self.nested is not None

    @property
    def apart(self) -> NDArray[np.bool_]:
        """Mask of local cells with nodes that they share with others, but not in the mesh."""
        new = self.in_sheets >= self.grid.size
        return new if self.nested is None else new | self.nested.at_others[self.in_nested()]

    def cell_nodes(self, cells: NDArray[np.int32], degree: int) -> Indices:
        """Numbers of the nodes of local cells if `joined`, in the order of DOLFINx, shape (cells, nodes)."""
        steps = fem.node_steps(self.domain, degree)
        if self.nested is None:
            assert self.sheets is not None
            return self.sheets.nodes(self.in_sheets[cells], degree, steps)
        nodes = self.nested.nodes(self.in_nested()[cells], degree, steps)
        if self.sheets is not None:  # all cells near surfaces are of the finest level
            finest = ~self.nested.coarse[self.numbers[cells]]
            nodes[finest] = self.sheets.nodes(self.in_sheets[cells[finest]], degree, steps)
        return nodes

    def origins(self, cells: NDArray[np.int32]) -> Array:
        """First corners of some local cells of the finest lattice [m], shape (cells, dim)."""
        index = np.unravel_index(self.numbers[cells], self.grid.shape, order="F")
        return np.stack([edge[i] for edge, i in zip(self.grid.edges, index, strict=True)], axis=1)

    def find_interior_faces(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """(local faces, their two local cells) of all faces between two local cells; found once (collective)."""
        if self._interior_faces is None:
            self._interior_faces = fem.interior_facets(self.domain)
        return self._interior_faces

    def find_outer_faces(self) -> tuple[NDArray[np.int32], NDArray[np.int32], Array]:
        """(local faces on the boundary of the box, their cells, midpoints [m] of shape (faces, dim)) (collective)."""
        faces, cells = fem.boundary_facets(self.domain)
        return faces, cells, fem.facet_midpoints(self.domain, faces)

    @cached_property
    def window(self) -> tuple[Indices, tuple[int, ...], Indices]:
        """(lowest index, shape, numbers of the owned cells) of the smallest box around them, last axis fastest."""
        index = np.stack(np.unravel_index(self.numbers[: self.owned], self.grid.shape, order="F"))
        low = index.min(axis=1, initial=np.iinfo(np.int64).max) if self.owned else np.zeros(self.dim, dtype=np.int64)
        shape = tuple((index.max(axis=1) - low + 1).tolist()) if self.owned else (0,) * self.dim
        return low, shape, np.ravel_multi_index(tuple(index - low[:, None]), shape) if self.owned else np.empty(0, int)

    def seams(self, periodic: tuple[int, ...] = ()) -> tuple[Indices, Indices]:
        """(owned cells, numbers of corners) for corners that are shared with cells of other processes or of a period.

        Corners are numbered in the lattice of all corners. Those at the end of a `periodic` axis have the numbers of
        those at its start.
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
        """Mask of the midpoints that lie on a box face such as 'x-'."""
        axis = "xyz".index(name[0])
        edge = self.grid.edges[axis]
        plane = edge[0] if name[1] == "-" else edge[-1]
        return np.abs(midpoints[:, axis] - plane) < 1e-9 * (edge[-1] - edge[0])
