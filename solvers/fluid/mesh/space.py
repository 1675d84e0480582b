"""The unknowns of the flow, velocity and pressure: their dofs and nodes on the grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import ufl
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.hanging import Hanging
from solvers.fluid.mesh.periodic import LatticeNodes, join_ends
from solvers.fluid.mesh.sheet_cells import join_nodes
from solvers.mesh.distributed import Nodal
from solvers.values import Value, evaluate

Dofs = NDArray[np.int32]


@dataclass(frozen=True)
class FlowNodes:
    """Local nodes of one quantity, owned ones first."""

    dofs: Dofs  #: local dofs, shape (nodes, components)
    points: Array  #: positions [m], shape (nodes, dim)
    numbers: NDArray[np.int64]  #: number in the box's lattice, the same for every distribution
    sizes: Array  #: mean edge lengths [m] of the cells around each, of the finest lattice, shape (nodes, dim)
    owned: int
    consecutive: NDArray[np.int64]  #: numbers from 0 in the order of `numbers`, which have gaps on nested cells


class Unknowns:
    """Q1-Q1 (degree 1) or Q2-Q1 (degree 2): velocity and pressure in one function space.

    Along `periodic` axes (0, 1, 2) the nodes at the end of the box are identified with those at its beginning. The
    last cells have the unknowns of the first nodes, so that assembly does not need to treat periods.
    """

    def __init__(self, grid: DistributedGrid, degree: int, periodic: Sequence[int] = ()):
        self.grid, self.degree, self.dim, self.periodic = grid, degree, grid.dim, tuple(periodic)
        self.space = fem.flow_space(grid.domain, degree)
        nodes = [self._lattice_nodes(range(self.dim), degree), self._lattice_nodes([self.dim], 1)]
        if grid.joined:
            self.space, nodes = join_nodes(grid, self.space, degree, nodes)
        if self.periodic:
            self.space, nodes = join_ends(grid.comm, self.space, nodes)
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
        self.velocity, self.pressure = (self._nodes(some, d) for some, d in zip(nodes, (degree, 1), strict=True))
        self.velocity_mask = np.zeros(self.local, dtype=bool)  #: which local dofs are velocities
        self.velocity_mask[self.velocity.dofs] = True
        #: hanging nodes, whose values are interpolated from coarser cells; None on a uniform grid
        self.hanging = None if grid.nested is None else self._hanging()

    # ------------------------------------------------------------------------------------------- nodes of the lattice

    def lattice_shape(self, degree: int) -> tuple[int, ...]:
        """Count of nodes of this degree per direction; along a periodic axis the last one is not counted."""
        return tuple(degree * n + (axis not in self.periodic) for axis, n in enumerate(self.grid.grid.shape))

    def _lattice_nodes(self, components: Sequence[int], degree: int) -> LatticeNodes:
        dofs, points = fem.component_dofs(self.grid.domain, self.space, components, degree)
        number, stride = np.zeros(len(dofs), dtype=np.int64), 1
        at_start, at_end = np.zeros((2, len(dofs)), dtype=bool)
        points = points.copy()
        for axis, (edge, count) in enumerate(zip(self.grid.grid.edges, self.lattice_shape(degree), strict=True)):
            lattice = np.interp(np.arange(degree * (len(edge) - 1) + 1) / degree, np.arange(len(edge)), edge)
            index = np.searchsorted(0.5 * (lattice[1:] + lattice[:-1]), points[:, axis])
            if axis in self.periodic:
                at_start |= index == 0
                at_end |= index == count
                points[index == count, axis] = edge[0]
            number += stride * (index % count)
            stride *= count
        return LatticeNodes(dofs, points, number, at_start, at_end)

    def _nodes(self, nodes: LatticeNodes, degree: int) -> FlowNodes:
        joined = self.periodic or self.grid.joined
        keep = np.unique(nodes.dofs[:, 0], return_index=True)[1] if joined else slice(None)
        dofs, points = nodes.dofs[keep], nodes.points[keep]
        owned = int(np.count_nonzero(dofs[:, 0] < self.owned))
        numbers, nested = nodes.numbers[keep], self.grid.nested
        consecutive = numbers if nested is None else nested.consecutive(numbers, degree)
        return FlowNodes(dofs, points, numbers, self._sizes(points, degree), owned, consecutive)

    def _hanging(self) -> Hanging:
        assert self.grid.nested is not None
        parts = []
        for nodes, degree in ((self.velocity, self.degree), (self.pressure, 1)):
            own = nodes.numbers < np.prod(self.lattice_shape(degree))  # no node of `sheets` hangs, nor holds one
            parts.append((nodes.dofs[own], nodes.numbers[own], int(np.count_nonzero(own[: nodes.owned])), degree))
        return Hanging(
            self.grid.comm,
            self.grid.nested,
            parts,
            self.global_dofs,
            self.owned,
            (self.cell_velocity, self.cell_pressure),
        )

    def _sizes(self, points: Array, degree: int) -> Array:
        """Mean edge lengths [m] of the cells around nodes, shape (nodes, dim)."""
        sizes = np.empty(points.shape)
        for axis, edge in enumerate(self.grid.grid.edges):
            lattice = np.interp(np.arange(degree * (len(edge) - 1) + 1) / degree, np.arange(len(edge)), edge)
            index, h = np.searchsorted(0.5 * (lattice[1:] + lattice[:-1]), points[:, axis]), np.diff(edge)
            before, after = -(-index // degree) - 1, index // degree
            sizes[:, axis] = 0.5 * (h[np.maximum(before, 0)] + h[np.minimum(after, len(h) - 1)])
        return sizes

    @cached_property
    def at_pressure(self) -> NDArray[np.int64]:
        """Index of the velocity node at each pressure node."""
        if self.grid.sheets is not None:
            numbers = self.grid.sheets.among_finer(self.pressure.numbers, self.degree)
        else:
            index = np.unravel_index(self.pressure.numbers, self.lattice_shape(1), order="F")
            fine = [self.degree * i for i in index]
            numbers = np.ravel_multi_index(fine, self.lattice_shape(self.degree), order="F")
        order = np.argsort(self.velocity.numbers)
        return order[np.searchsorted(self.velocity.numbers, numbers, sorter=order)]

    def size(self) -> int:
        """Dofs on all processes."""
        return int(self.index_map.size_global) * self.block_size

    def counted(self) -> int:
        """Dofs of nodes on all processes, without hanging ones (collective)."""
        dofs = np.concatenate([nodes.dofs[: nodes.owned].ravel() for nodes in (self.velocity, self.pressure)])
        free = len(dofs) if self.hanging is None else int(np.count_nonzero(~self.hanging.dofs[dofs]))
        return int(self.grid.comm.allreduce(free))

    def share(self, function) -> None:
        """Update values at hanging nodes and ghosts from the owned unknowns (collective)."""
        if self.hanging is not None:
            values = function.x.array
            values[: self.owned] = self.hanging.values(values[: self.owned])
        function.x.scatter_forward()

    def parts(self, flow) -> tuple[ufl.core.expr.Expr, ufl.core.expr.Expr]:
        """(u, p) of a function, test or trial function of the space."""
        return ufl.as_vector([flow[i] for i in range(self.dim)]), flow[self.dim]

    def expand(self, blocks: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Mask of local dofs from a mask of local blocks."""
        return np.repeat(blocks, self.block_size)

    # ---------------------------------------------------------------------------------------------- to save values

    def to_nodes(self, values: Array, nodes: FlowNodes) -> Nodal:
        """The values of owned nodes, from those at local dofs."""
        return Nodal(values[nodes.dofs[: nodes.owned]].astype(float), nodes.consecutive[: nodes.owned])

    def from_nodes(self, values: Array, nodes: FlowNodes) -> Array:
        """The values at local dofs, from those of owned nodes; zero at other dofs (collective)."""
        owned = np.zeros(self.local)
        owned[nodes.dofs[: nodes.owned]] = values
        return fem.share_owned(self.space, owned)


def set_velocity(values: Array, nodes: FlowNodes, components: Sequence[Value], t: float) -> None:
    """Set velocity components at the nodes to given values at time t [s]; `values` at local dofs, changed in place."""
    points = np.zeros((3, len(nodes.points)))
    points[: nodes.points.shape[1]] = nodes.points.T
    for axis, component in enumerate(components):
        values[nodes.dofs[:, axis]] = evaluate(component, points, t)
