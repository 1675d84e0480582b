"""The ghost penalty, `forms.ghost_penalty`, across the faces at the ends of periods, which are no faces of the mesh.

Functions of first degree have on such a face, with the planes of nodes -1, 0, 1 at the distances h_0 and h_1, the jump

    [d_n u] = u_(-1) / h_0 - (1 / h_0 + 1 / h_1) u_0 + u_1 / h_1

at each point of the face, along which they are bilinear. The process that owns the cell at the start of the period
assembles the face. What depends on the cell at the end comes from the process that owns that one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import product

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.rows import from_entries
from solvers.api import Array, Indices
from solvers.fluid.cut.cut import Cut
from solvers.fluid.mesh.directory import Directory
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.penalties import Penalties
from solvers.fluid.terms.poorly_cut.ghost import FaceFlow, Scales

#: Of a line between nodes: int N_a N_b ds / h.
MASS = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0


@dataclass(frozen=True)
class CellScales:
    """Scales in the local cells: those of the form, and those of gaps."""

    viscosity: Array  #: mu [Pa s]
    phi: Array
    convective: Array
    has_history: Array
    pressure: Array  #: factor of the penalty of the pressure
    kink: Array  #: factor of that of the velocity, less 1, by axis, (cells, dim)

    def table(self) -> Array:
        """All of them, (cells, 5 + dim)."""
        first = (self.viscosity, self.phi, self.convective, self.has_history, self.pressure)
        return np.column_stack([*first, self.kink])


@dataclass(frozen=True)
class _Seam:
    """The faces at the ends of one period that this process assembles."""

    axis: int
    cells: Indices  #: owned cells at the start
    start: Indices  #: their numbers in the box
    end: Indices  #: numbers of the cells at the end that they meet
    h: Array  #: mean length of both along the axis [m], (faces,)
    blocks: Array  #: int [d_n N_a] [d_n N_b] ds, (faces, nodes, nodes)
    velocity: Indices  #: global dofs of the nodes, (faces, nodes, dim)
    pressure: Indices  #: (faces, nodes, 1)


class SeamPenalty:
    """The penalty of all periods of a flow without cells of the sides of thin bodies."""

    def __init__(
        self,
        unknowns: Unknowns,
        flow: FaceFlow,
        penalties: Penalties,
    ):
        """Collective."""
        self._unknowns, self._flow, self._penalties = unknowns, flow, penalties
        grid = unknowns.grid
        self._owned = (unknowns.owned, unknowns.owned)
        tables = []
        for nodes in (unknowns.velocity, unknowns.pressure):
            dofs = unknowns.global_dofs[nodes.dofs[: nodes.owned]]
            size = int(np.prod(unknowns.lattice_shape(1)))
            tables.append(Directory(grid.comm, nodes.numbers[: nodes.owned], dofs, size))
        self._seams = [self._seam(axis, *tables) for axis in unknowns.periodic]
        self._on = [np.zeros(len(seam.cells), dtype=bool) for seam in self._seams]

    def _seam(self, axis: int, velocity: Directory, pressure: Directory) -> _Seam:
        unknowns, grid = self._unknowns, self._unknowns.grid
        shape, edges, dim = grid.grid.shape, grid.grid.edges, grid.dim
        index = np.stack(np.unravel_index(grid.numbers[: grid.owned], shape, order="F"))
        cells = np.flatnonzero(index[axis] == 0)
        index = index[:, cells]
        start = grid.numbers[cells]
        end = start + (shape[axis] - 1) * int(np.prod(shape[:axis]))
        others = [other for other in range(dim) if other != axis]
        last, first = edges[axis][-1] - edges[axis][-2], edges[axis][1] - edges[axis][0]
        jump = np.array([1.0 / last, -1.0 / last - 1.0 / first, 1.0 / first])
        area = reduce(np.multiply, (np.diff(edges[other])[index[other]] for other in others))
        # nodes: planes of the axis slowest, then the other directions in turn
        along = reduce(np.kron, [MASS] * len(others))
        blocks = area[:, None, None] * np.kron(np.outer(jump, jump), along)
        lattice, number = unknowns.lattice_shape(1), []
        for plane, *sides in product((-1, 0, 1), *[(0, 1)] * len(others)):
            at = index.copy()
            at[axis] = plane
            at[others] += np.array(sides)[:, None]
            at %= np.array(lattice)[:, None]
            number.append(np.ravel_multi_index(tuple(at), lattice, order="F"))
        numbers = np.stack(number, axis=1)
        dofs = [table(numbers.ravel()).reshape(*numbers.shape, n) for table, n in ((velocity, dim), (pressure, 1))]
        return _Seam(axis, cells, start, end, np.full(len(cells), 0.5 * (first + last)), blocks, dofs[0], dofs[1])

    def set_cut(self, cut: Cut) -> bool:
        """Take the faces between active cells of which one is poorly cut; whether these are others than before."""
        before, self._on = self._on, []
        for seam in self._seams:
            ends = np.stack([seam.start, seam.end])
            self._on.append(cut.special[ends].any(axis=0) & cut.is_active[ends].all(axis=0))
        return not all(map(np.array_equal, before, self._on))

    def entries(self) -> NDArray[np.int64]:
        """Count of entries that owned rows may have (collective)."""
        matrix = self._matrix([(np.ones(len(seam.cells)),) * 2 for seam in self._seams])
        found = np.diff(matrix.getValuesCSR()[0]).astype(np.int64)
        matrix.destroy()
        return found

    def fill(self, matrix: PETSc.Mat) -> None:
        """Insert all entries that it may have (collective)."""
        self._add(matrix, [(np.ones(len(seam.cells)),) * 2 for seam in self._seams])

    def assemble(self, matrix: PETSc.Mat, scales: Scales, cells: CellScales, history: Array) -> None:
        """Add its matrix, and its term of the earlier steps at local dofs (collective)."""
        table, steady = cells.table(), self._flow.coefficients.steady
        of_flow: list[tuple[Array, Array]] = []
        of_past: list[tuple[Array, Array]] = []
        for seam, on in zip(self._seams, self._on, strict=True):
            here, there = table[seam.cells], self._at_end(seam, table)
            mean, both = 0.5 * (here + there), here[:, 3] * there[:, 3]
            velocity = self._penalties.ghost_viscous * mean[:, 0] * (1.0 + mean[:, 5 + seam.axis])
            if self._flow.coefficients.convection:
                velocity += self._penalties.ghost_convection * scales.density * mean[:, 2]
            mass = (0.0 if steady else self._penalties.ghost_mass * scales.density) * seam.h**2
            acts: Array = on.astype(float)
            rate = self._flow.alpha() + self._penalties.ghost_fading * scales.alpha
            pressure = self._penalties.ghost_pressure * seam.h**3 / (scales.density * mean[:, 1])
            pressure *= np.minimum(here[:, 4], there[:, 4])
            of_flow.append((np.asarray(acts * seam.h * (velocity + mass * rate)), np.asarray(acts * pressure)))
            of_past.append((np.asarray(acts * seam.h * mass * both), np.zeros(len(on))))
        self._add(matrix, of_flow)
        if not steady:
            through = self._matrix(of_past)
            past, found = through.createVecs()
            past.array[:] = self._flow.past.x.array[: self._unknowns.owned]
            through.mult(past, found)
            history[: self._unknowns.owned] += found.array
            for each in (past, found, through):
                each.destroy()

    def _at_end(self, seam: _Seam, table: Array) -> Array:
        """Rows of a table of local cells, for the cells at the end (collective)."""
        grid = self._unknowns.grid
        at = np.unravel_index(grid.numbers[: grid.owned], grid.grid.shape, order="F")[seam.axis]
        mine = np.flatnonzero(at == grid.grid.shape[seam.axis] - 1)
        parts = grid.comm.allgather((grid.numbers[mine], table[mine]))
        numbers, rows = (np.concatenate(column) for column in zip(*parts, strict=True))
        order = np.argsort(numbers)
        return np.asarray(rows[order[np.searchsorted(numbers[order], seam.end)]])

    def _add(self, matrix: PETSc.Mat, factors: list[tuple[Array, Array]]) -> None:
        own = self._matrix(factors)
        matrix.setValuesCSR(*own.getValuesCSR(), addv=PETSc.InsertMode.ADD_VALUES)
        own.destroy()

    def _matrix(self, factors: list[tuple[Array, Array]]) -> PETSc.Mat:
        """The sum of all faces, with factors of velocity and pressure by seam (collective)."""
        rows, columns, data = [], [], []
        for seam, of_parts in zip(self._seams, factors, strict=True):
            for dofs, factor in zip((seam.velocity, seam.pressure), of_parts, strict=True):
                blocks = factor[:, None, None] * seam.blocks
                for component in range(dofs.shape[2]):
                    some = dofs[:, :, component]
                    rows.append(np.broadcast_to(some[:, :, None], blocks.shape).ravel())
                    columns.append(np.broadcast_to(some[:, None, :], blocks.shape).ravel())
                    data.append(blocks.ravel())
        entries = (np.concatenate(some) for some in (rows, columns, data))
        return from_entries(self._unknowns.grid.comm, self._owned, *entries)
