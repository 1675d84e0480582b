"""The extension penalty, on the distance of poorly cut nodes to their extension, c_i u = u_i - E u(x_i).

    s(u, v) = sum_i d_i (c_i u) (c_i v),   d_i = gamma w_i phi V / h^2 (velocity),  d_i = gamma w_i V / phi (pressure),

with phi = mu + rho |a| h + rho alpha h^2, in films mu + rho alpha h^2 (docs/theory_fluid.md, Extension penalty and
Films). Nodes whose cells have no fluid are no unknowns. Their velocity is that of the extension, which later steps use
as history. Their pressure is not used.
Source: Badia, Neiva, Verdugo, Comput. Methods Appl. Mech. Engrg. 388 (2022) 114232.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.algebra.rows import from_entries
from solvers.api import Array, Indices
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.extension import LAYERS_NEARBY, Extension
from solvers.fluid.mesh.directory import Directory
from solvers.fluid.mesh.space import FlowNodes, Unknowns
from solvers.fluid.terms.matrix import Pattern
from solvers.fluid.terms.poorly_cut.ghost import Scales

Entries = tuple[Indices, Indices, Array]  #: global rows, global columns, values


class ExtensionPenalty:
    """Implements `CutPenalty` by S = C^T D C; arrays have an entry per owned dof."""

    by_faces = False

    def __init__(self, unknowns: Unknowns, factor: float):
        self.unknowns, self.factor = unknowns, factor
        self._comm = unknowns.grid.comm
        self._lattices = [self._lattice(unknowns.velocity, unknowns.degree), self._lattice(unknowns.pressure, 1)]
        self._entries: tuple[Indices, Indices] = (np.empty(0, dtype=np.int64),) * 2
        self._weight, self._film = np.zeros(unknowns.owned), np.ones(unknowns.owned)  #: w_i, and factor of films
        self._scales: Scales | None = None
        #: owned dofs of nodes without fluid, and those that are penalised
        self.outside, self.dependent = np.zeros((2, unknowns.owned), dtype=bool)
        self.undetermined = np.zeros(unknowns.local, dtype=bool)
        none = (self._entries[0], self._entries[0], np.empty(0))
        self._distance, self._extend = self._matrix(none), self._matrix(none)
        self.stale = True

    def _lattice(self, nodes: FlowNodes, degree: int) -> tuple[FlowNodes, Extension, Directory]:
        grid, owned = self.unknowns.grid, nodes.owned
        numbers, shape = nodes.numbers[:owned], self.unknowns.lattice_shape(degree)
        extension = Extension(grid.grid, degree, shape, numbers, grid.sheets)
        dofs = self.unknowns.global_dofs[nodes.dofs[:owned]]
        return nodes, extension, Directory(self._comm, numbers, dofs, extension.size)

    def _matrix(self, entries: Entries) -> PETSc.Mat:
        return from_entries(self._comm, (self.unknowns.owned, self.unknowns.owned), *entries)

    @property
    def integrals(self) -> list[fem.Integral]:
        return []

    def begin_step(self, unknown: NDArray[np.bool_]) -> None:
        """Choose the roots anew."""
        for _, extension, _ in self._lattices:
            extension.begin_step()

    def set_cut(self, cut: Cut, prescribed: NDArray[np.int64]) -> bool:
        unknowns, before, self.stale = self.unknowns, self._entries, True
        self.outside[:], self.dependent[:], self.undetermined[:], self._weight[:] = False, False, False, 0.0
        free = np.ones(unknowns.local, dtype=bool)
        free[prescribed] = False
        parts = [self._find(cut, free, *lattice) for lattice in self._lattices]
        self._film = self._factor_of_films(cut)[: unknowns.owned]
        self.undetermined[:] = fem.share_owned(unknowns.space, self.undetermined.astype(float)) > 0.5
        rows, columns, data = (np.concatenate(some) for some in zip(*parts, strict=True))
        outside = self.outside[rows - unknowns.global_dofs[0]] if len(rows) else np.zeros(0, dtype=bool)
        own = unknowns.global_dofs[: unknowns.owned][self.dependent]
        self._distance.destroy()
        self._extend.destroy()
        self._extend = self._matrix((rows[outside], columns[outside], data[outside]))
        rows, columns = (np.concatenate([own, some[~outside]]) for some in (rows, columns))
        self._entries = (rows, columns)
        self._distance = self._matrix((rows, columns, np.concatenate([np.ones(len(own)), -data[~outside]])))
        same = all(map(np.array_equal, before, self._entries))
        return self._comm.allreduce(int(same)) < self._comm.size

    def _factor_of_films(self, cut: Cut) -> Array:
        """Smallest factor of films in the cells of each local dof."""
        unknowns, factor = self.unknowns, np.ones(self.unknowns.local)
        if cut.film is not None:
            by_cell = cut.film[unknowns.grid.numbers]
            np.minimum.at(factor, unknowns.cell_velocity, by_cell[:, None, None])
            np.minimum.at(factor, unknowns.cell_pressure, by_cell[:, None])
        return factor

    def _find(
        self, cut: Cut, free: NDArray[np.bool_], nodes: FlowNodes, extension: Extension, directory: Directory
    ) -> Entries:
        """Entries of E of one quantity, velocity or pressure."""
        extension.follow(self.unknowns.grid.sheets)
        found = extension(cut.share, cut.is_active, cut.depth + LAYERS_NEARBY)
        entries, dofs = found.rows.tocoo(), nodes.dofs[found.nodes]
        dry = free[dofs] & found.dry[:, None]
        if nodes is self.unknowns.velocity:
            self.outside[dofs] = dry
        else:
            self.undetermined[dofs] = dry
        self.dependent[dofs] = free[dofs] & ~found.dry[:, None]
        self._weight[dofs] = found.weight[:, None]
        self.undetermined[nodes.dofs[found.undetermined]] = True
        kept, columns = (free & ~self.undetermined)[dofs[entries.row]], directory(entries.col.astype(np.int64))
        rows = self.unknowns.global_dofs[dofs[entries.row]]
        return rows[kept], columns[kept], np.broadcast_to(entries.data[:, None], kept.shape)[kept]

    def set_scales(self, scales: Scales) -> None:
        self._scales, self.stale = scales, True

    def penalties(self) -> Array:
        """d_i at owned dofs."""
        unknowns, scales, found = self.unknowns, self._scales, np.zeros(self.unknowns.owned)
        if scales is None:
            return found
        speeds = (scales.speed, scales.speed[unknowns.at_pressure])
        for nodes, speed in zip((unknowns.velocity, unknowns.pressure), speeds, strict=True):
            dofs, sizes = nodes.dofs[: nodes.owned], nodes.sizes[: nodes.owned]
            h, volume, film = sizes.min(axis=1), sizes.prod(axis=1), self._film[dofs[:, 0]]
            convection = np.where(film < 1.0, 0.0, speed[: nodes.owned] * h)
            phi = scales.viscosity + scales.density * (convection + scales.alpha * h**2)
            scale = phi * volume / h**2 if nodes is unknowns.velocity else volume / phi
            found[dofs] = (self.factor * film * scale)[:, None]
        return self._weight * found

    def _product(self) -> tuple[Indices, Indices, Array]:
        """S by compressed owned rows (collective)."""
        scaled, d = self._distance.copy(), self._distance.createVecLeft()
        d.array[:] = self.penalties()
        scaled.diagonalScale(L=d)
        product = self._distance.transposeMatMult(scaled)
        rows = product.getValuesCSR()
        scaled.destroy()
        product.destroy()
        return rows

    def extra_entries(self) -> NDArray[np.int64]:
        return np.diff(self._product()[0]).astype(np.int64)

    def fill(self, matrix: PETSc.Mat, pattern: Pattern) -> None:
        matrix.setValuesCSR(*self._product(), addv=PETSc.InsertMode.ADD_VALUES)

    def assemble(self, matrix: PETSc.Mat, history: Array) -> None:
        self.stale = False
        matrix.setValuesCSR(*self._product(), addv=PETSc.InsertMode.ADD_VALUES)

    def settle(self, values: Array) -> Array:
        x, y = self._extend.createVecs()
        x.array[:] = values
        self._extend.mult(x, y)
        return np.where(self.outside, y.array, values)
