"""Nodal values as combinations of unknowns: the one place that makes them.

    u = T w,   T_i = e_i for a free node,   T_i = s_i e_i + E_i T for a dependent one

E: extension (solvers.fluid.extension). The unknown w_i of a dependent node is its distance to the extension; where it
has none, s_i = 0, else s_i = 1. The equations are T^T r(T w), to which each such row adds d_i w_i: with d_i -> 0 the
node becomes free, with d_i -> infinity it is what the extension says. Rows of E sum to one, so that nothing is lost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.fluid.cut import Cut
from solvers.fluid.directory import Directory
from solvers.fluid.extension import NEAR, Dependent, Extension
from solvers.fluid.space import Nodes, Unknowns
from solvers.rows import from_entries

Mask = NDArray[np.bool_]
Numbers = NDArray[np.int64]

#: Roots that may depend on each other one after the other.
LONGEST = 10


class Combinations:
    """T of one cut; arrays are those of owned dofs."""

    def __init__(self, unknowns: Unknowns):
        self.unknowns = unknowns
        self._comm = unknowns.grid.comm
        self._lattices = [
            self._lattice(unknowns.velocity, unknowns.degree),
            self._lattice(unknowns.pressure, 1),
        ]
        self._entries: tuple[Numbers, ...] = ()
        self._nothing()

    def _lattice(self, nodes: Nodes, degree: int) -> tuple[Nodes, Extension, Directory]:
        grid, owned = self.unknowns.grid, nodes.owned
        extension = Extension(grid.grid, degree, self.unknowns.lattice_shape(degree), nodes.numbers[:owned])
        dofs = self.unknowns.global_dofs[nodes.dofs[:owned]]
        size = int(np.prod(extension.shape))
        return nodes, extension, Directory(self._comm, nodes.numbers[:owned], dofs, size)

    def _nothing(self) -> None:
        """All nodes are free."""
        unknowns = self.unknowns
        self.weight = np.zeros(unknowns.owned)  #: of the penalty on owned unknowns, 1 to 0 where a node is free
        self.eliminated = np.zeros(unknowns.owned, dtype=bool)  #: owned dofs without an unknown of their own
        self.dependent = np.zeros(unknowns.local, dtype=bool)  #: local dofs with an extension
        self.lost = np.zeros(unknowns.local, dtype=bool)  #: local dofs of active cells without fluid nearby
        self._extend: PETSc.Mat | None = None
        self._combine: PETSc.Mat | None = None

    @property
    def matrix(self) -> PETSc.Mat | None:
        """T, None if all nodes are free."""
        return self._combine

    def begin_step(self) -> None:
        """Nodes may take other roots."""
        for _, extension, _ in self._lattices:
            extension.begin_step()

    def set(self, cut: Cut, prescribed: NDArray[np.int64]) -> bool:
        """Take a cut; True if the pattern of T is another one than before (collective).

        `prescribed`: local dofs with given values, which depend on nothing.
        """
        before = self._entries
        self._prescribed = np.zeros(self.unknowns.local, dtype=bool)
        self._prescribed[prescribed] = True
        if not self._make(*self._find_all(cut)):
            # roots of earlier iterates and of this one depend on each other
            self.begin_step()
            self._make(*self._find_all(cut))
        same = len(before) > 0 and all(map(np.array_equal, before, self._entries))
        return self._comm.allreduce(int(same)) < self._comm.size

    def _find_all(self, cut: Cut) -> tuple[Numbers, Numbers, Array]:
        """Entries (global row, global column, value) of E."""
        self._nothing()
        parts = [self._find(cut, *lattice) for lattice in self._lattices]
        rows, columns, data = (np.concatenate(some) for some in zip(*parts, strict=True))
        for mark in (self.dependent, self.lost):
            mark[:] = fem.share_owned(self.unknowns.space, mark.astype(float)) > 0.5
        return rows, columns, data

    def _find(self, cut: Cut, nodes: Nodes, extension: Extension, directory: Directory):
        """Those of one quantity."""
        # the next steps ask the strip for its velocity alone
        cells = cut.wet if nodes is self.unknowns.pressure else cut.alive
        found: Dependent = extension(cut.share, cells, cut.depth + NEAR)
        entries = found.rows.tocoo()
        columns = directory(entries.col.astype(np.int64))
        dofs = nodes.dofs[found.nodes]
        free = ~self._prescribed[dofs]
        self.weight[dofs] = free * found.weight[:, None]
        self.eliminated[dofs] = free & found.dry[:, None]
        self.dependent[dofs] = free
        self.lost[nodes.dofs[found.lost]] = True
        kept = free[entries.row]
        rows = self.unknowns.global_dofs[dofs[entries.row]]
        return rows[kept], columns[kept], np.broadcast_to(entries.data[:, None], kept.shape)[kept]

    def _make(self, rows: Numbers, columns: Numbers, data: Array) -> bool:
        """Build T; False if nodes depend on each other in a circle (collective)."""
        self._entries = (rows, columns)
        if not self._comm.allreduce(len(rows)):
            return True
        owned = self.unknowns.owned
        diagonal = self.unknowns.global_dofs[:owned]
        sizes, own = (owned, owned), (~self.eliminated).astype(float)
        E = from_entries(self._comm, sizes, rows, columns, data)
        rows, columns = (np.concatenate([diagonal, some]) for some in (rows, columns))
        T = from_entries(self._comm, sizes, rows, columns, np.concatenate([own, data]))
        self._in, self._out = T.createVecs()
        self._chains = self._longest_chain(E)
        if self._chains > 0:
            J = from_entries(self._comm, sizes, diagonal, diagonal, own)
            for _ in range(self._chains):
                T = E.matMult(T)
                T.axpy(1.0, J, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        self._extend, self._combine = E, T
        return self._chains >= 0

    def _longest_chain(self, E: PETSc.Mat) -> int:
        """How often a root has nodes that depend on another root, which is cut better each time; -1 for a circle."""
        # values that do not cancel: E has both signs
        self._in.array[:] = self.dependent[: self.unknowns.owned] * np.random.default_rng(0).random(len(self.weight))
        for length in range(LONGEST):
            E.mult(self._in, self._out)
            if self._out.norm() == 0.0:
                return length
            self._out.copy(self._in)
        return -1

    # -------------------------------------------------------------------------------------- values and equations

    def values(self, unknowns: Array) -> Array:
        """T w (collective)."""
        return self._times(self._combine, unknowns, unknowns)

    def collect(self, rows: Array) -> Array:
        """T^T r (collective)."""
        if self._combine is None:
            return rows
        self._in.array[:] = rows
        self._combine.multTranspose(self._in, self._out)
        return self._out.array.copy()

    def extended(self, values: Array) -> Array:
        """E u; zero at free nodes (collective)."""
        return self._times(self._extend, values, np.zeros_like(values))

    def distance(self, values: Array) -> Array:
        """u - E u at dependent nodes, zero at free ones (collective)."""
        return np.where(self.dependent[: len(values)], values, 0.0) - self.extended(values)

    def settle(self, values: Array, fresh: Mask) -> Array:
        """Values of which eliminated nodes, and `fresh` ones, are what the extension says (collective)."""
        if self._extend is None:
            return values
        put = self.dependent[: len(values)] & (fresh | self.eliminated)
        for _ in range(self._chains + 1):
            values = np.where(put, self.extended(values), values)
        return values

    def _times(self, matrix: PETSc.Mat | None, values: Array, otherwise: Array) -> Array:
        if matrix is None:
            return otherwise
        self._in.array[:] = values
        matrix.mult(self._in, self._out)
        return self._out.array.copy()
