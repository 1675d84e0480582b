"""The unknowns of the flow: velocity and pressure on the grid, which dofs and nodes they have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import ufl
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid.grid import DistributedGrid

Dofs = NDArray[np.int32]


@dataclass(frozen=True)
class Nodes:
    """Where one quantity lives; local nodes, owned ones first."""

    dofs: Dofs  #: local dofs, shape (nodes, components)
    points: Array  #: positions [m], shape (nodes, dim)
    numbers: NDArray[np.int64]  #: number in the box's lattice, the same for every distribution
    owned: int


class Unknowns:
    """Q1-Q1 (degree 1) or Q2-Q1 (degree 2): velocity and pressure in one function space."""

    def __init__(self, grid: DistributedGrid, degree: int):
        self.grid, self.degree, self.dim = grid, degree, grid.dim
        self.space = fem.flow_space(grid.domain, degree)
        self.block_size = int(self.space.dofmap.index_map_bs)
        #: dof blocks of each local cell
        self.cell_blocks: Dofs = fem.cell_blocks(self.space)
        self.index_map = self.space.dofmap.index_map
        self.owned = int(self.index_map.size_local) * self.block_size  #: owned dofs
        self.local = (int(self.index_map.size_local) + int(self.index_map.num_ghosts)) * self.block_size
        start = int(self.index_map.local_range[0])
        blocks = np.concatenate([start + np.arange(self.index_map.size_local), np.asarray(self.index_map.ghosts)])
        #: global number of each local dof
        self.global_dofs: NDArray[np.int64] = (
            blocks.astype(np.int64)[:, None] * self.block_size + np.arange(self.block_size)
        ).ravel()
        by_component = [fem.component_cell_dofs(self.space, component) for component in range(self.dim + 1)]
        #: velocity dofs of each local cell, shape (cells, functions, dim), and pressure dofs, (cells, functions)
        self.cell_velocity: Dofs = np.stack(by_component[: self.dim], axis=2)
        self.cell_pressure: Dofs = by_component[self.dim]
        self.velocity = self._nodes(range(self.dim), degree)
        self.pressure = self._nodes([self.dim], 1)

    def _nodes(self, components, degree: int) -> Nodes:
        dofs, points = fem.component_dofs(self.grid.domain, self.space, components, degree)
        return Nodes(dofs, points, self._lattice(points, degree), int(np.count_nonzero(dofs[:, 0] < self.owned)))

    def _lattice(self, points: Array, degree: int) -> NDArray[np.int64]:
        """Number of each point in the lattice of nodes of this degree, x fastest."""
        number, stride = np.zeros(len(points), dtype=np.int64), 1
        for axis, edge in enumerate(self.grid.grid.edges):
            lattice = np.interp(np.arange(degree * (len(edge) - 1) + 1) / degree, np.arange(len(edge)), edge)
            between = 0.5 * (lattice[1:] + lattice[:-1])
            number += stride * np.searchsorted(between, points[:, axis])
            stride *= len(lattice)
        return number

    def size(self) -> int:
        """Dofs on all processes."""
        return int(self.index_map.size_global) * self.block_size

    def parts(self, flow) -> tuple[ufl.core.expr.Expr, ufl.core.expr.Expr]:
        """(u, p) of a function, test or trial function of the space."""
        return ufl.as_vector([flow[i] for i in range(self.dim)]), flow[self.dim]

    def expand(self, blocks: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """A mark per local dof from one per local block."""
        return np.repeat(blocks, self.block_size)
