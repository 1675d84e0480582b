"""The coefficients of gaps in the weak forms, the cells in which they act, and the memory of the flow in them.

The mean velocity B of the parabola obeys rho B_t + friction B = -R, by backward Euler: without its past, the flow in a
gap would vanish as steps get smaller. In cells that were in no gap, B = -R / friction in their first step.
"""

from __future__ import annotations

import numpy as np
import ufl
from mpi4py import MPI
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array, Indices32
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.gaps import NarrowGaps
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.terms.contact_wedges import beside_contact
from solvers.fluid.terms.forms import GapScales


class GapTerms:
    """Functions that are constant in each cell; outside of gaps the terms vanish."""

    def __init__(self, grid: DistributedGrid, viscosity: float, density: float):
        self._grid, self._viscosity, self._density, dim = grid, viscosity, density, grid.dim
        space = fem.cellwise_space(grid.domain)
        self._share, self._friction, self._pressure = (fem.function(space) for _ in range(3))
        self._tangents = [fem.function(space) for _ in range(dim**2)]
        self._past, self._kink = ([fem.function(space) for _ in range(dim)] for _ in range(2))
        self.scales = GapScales(
            self._share,
            self._friction,
            ufl.as_vector(self._past),
            ufl.as_matrix([[self._tangents[dim * i + j] for j in range(dim)] for i in range(dim)]),
            self._pressure,
            ufl.as_vector(self._kink),
        )
        self.marked: NDArray[np.bool_] | None = None  #: mask of the local cells in gaps; None: no process has any
        self._gaps: NarrowGaps | None = None
        self._inertia = 0.0  #: rho / dt [Pa s/m^2], zero in steady flow
        self._beside_contact: Array | None = None  #: factor of `lengths` in local cells, where a contact is closed
        #: number in the box of each cell that was in a gap, sorted, and B [m/s] in it; the same on all processes
        self.memory: Array = np.empty((0, 1 + dim))

    def begin_step(self, dt: float | None) -> None:
        """Start a step of the length dt [s]; None: a steady flow."""
        self._inertia = 0.0 if dt is None else self._density / dt
        if self._gaps is not None:
            self._set_inertia(self._gaps)

    def set(self, cut: Cut) -> None:
        """Set the gaps to those of a cut (collective)."""
        self._beside_contact = None if self._grid.sheets is None else beside_contact(self._grid, cut)
        if not self._grid.comm.allreduce(cut.gaps is not None, op=MPI.LOR):
            self.marked = self._gaps = None
            return
        if self.marked is not None and cut.gaps is self._gaps:
            return
        gaps = self._gaps = cut.gaps
        self.marked = np.zeros(len(self._grid.numbers), dtype=bool)
        self._pressure.x.array[:] = 1.0
        of_cells = (self._share, *self._tangents, *self._kink)
        for function in of_cells:
            function.x.array[:] = 0.0
        if gaps is None:
            return
        row, self.marked = _rows(gaps.cells, self._grid.numbers)
        self._pressure.x.array[:] = gaps.pressure[self._grid.numbers]
        values = (gaps.share, *gaps.tangents.reshape(len(gaps.cells), -1).T, *gaps.across.T)
        for function, of_gaps in zip(of_cells, values, strict=True):
            function.x.array[self.marked] = of_gaps[row]
        self._set_inertia(gaps)

    def _set_inertia(self, gaps: NarrowGaps) -> None:
        """1 / tau, and the past of the flow in the gaps; both only matter there, and 1 / tau is positive elsewhere."""
        row, marked = _rows(gaps.cells, self._grid.numbers)
        known, of_memory = self.memory[:, 0].astype(np.int64), np.zeros((len(gaps.cells), 1 + self._grid.dim))
        if len(known):
            at, has = _rows(known, gaps.cells)
            of_memory[has, 0], of_memory[has, 1:] = 1.0, self.memory[at, 1:]
        inertia = self._inertia * of_memory[:, 0]
        self._friction.x.array[:] = self._viscosity
        self._friction.x.array[marked] = (gaps.friction(self._viscosity) + inertia)[row]
        for function, component in zip(self._past, of_memory[:, 1:].T, strict=True):
            function.x.array[:] = 0.0
            function.x.array[marked] = (inertia * component)[row]

    def end_step(self, flow: fem.Pointwise) -> None:
        """Keep B of the step (collective). flow: B [m/s] in the middle of cells."""
        if self.marked is None or not self._inertia:
            self.memory = self.memory[:0]
            return
        cells = self.among(np.arange(self._grid.owned, dtype=np.int32))
        found = np.concatenate([self._grid.numbers[cells, None], flow.on(cells)[:, 0]], axis=1)
        everywhere = np.concatenate(self._grid.comm.allgather(found))
        self.memory = everywhere[np.unique(everywhere[:, 0], return_index=True)[1]]

    @property
    def narrow(self) -> NDArray[np.bool_]:
        """Mask of the local cells with another ghost penalty."""
        return self._pressure.x.array < 1.0

    def among(self, cells: Indices32) -> Indices32:
        """Those in gaps among some local cells."""
        assert self.marked is not None
        return cells[self.marked[cells]]

    def lengths(self, cells: Indices32) -> Array:
        """Factor of the length over which Nitsche's penalty acts in some local cells.

        `NarrowGaps.reduced`, and `beside_contact` on sheets.
        """
        if self._beside_contact is not None:
            return self._beside_contact[cells]
        factor = np.ones(len(cells))
        if self._gaps is not None:
            row, found = _rows(self._gaps.cells, self._grid.numbers[cells])
            factor[found] = self._gaps.reduced[row]
        return factor


def _rows(known: NDArray[np.int64], numbers: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(rows in a sorted table of those numbers that are in it, mask of these numbers)."""
    row = np.minimum(np.searchsorted(known, numbers), len(known) - 1)
    found = known[row] == numbers
    return row[found], found
