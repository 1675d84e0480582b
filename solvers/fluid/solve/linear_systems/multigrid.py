"""Geometric multigrid for the flow: each level has a subset of the nodes of the next finer one (`level_grid`).

P is the multilinear interpolation to the others, and coarse matrices are P^T A P. Held unknowns, which include those
without fluid and hanging nodes, get no correction. The first coarse level of a velocity of second degree has the
vertices.
Source: Trottenberg, Oosterlee, Schuller, Multigrid (2001), sections 2.4, 5.1 and 8.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy import sparse

from solvers.algebra.linear import BLOCKS, incomplete_factors
from solvers.api import Array, Indices
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.solve.linear_systems.coarse_matrix import CoarseMatrix
from solvers.fluid.solve.linear_systems.decoupled import decoupled
from solvers.fluid.solve.linear_systems.level_copies import from_second_degree, second_degree, vertices
from solvers.fluid.solve.linear_systems.level_grid import LevelGrid
from solvers.fluid.solve.linear_systems.near_smoother import NearSmoother
from solvers.fluid.solve.linear_systems.pinned_levels import pinned

#: What is added to the diagonal of unknowns behind surfaces for the smoother, relative to the sum of |entries| of the
#: row. Without it incomplete factors of three layers in stretched cells amplify by 1e16. From 0.01 to 0.2 a ball that
#: falls in a tube takes 56 to 61 iterations in two steps; with 1 it takes 108, for smoothers then move these unknowns
#: slowly.
BEHIND = 0.05

#: Unknowns below which a level is solved directly, in less time than the levels above take to smooth.
COARSEST = 2_000


class Surfaces(Protocol):
    """Which owned unknowns are where (collective)."""

    def dofs_near_surfaces(self) -> NDArray[np.bool_]: ...

    def dofs_behind_surfaces(self) -> NDArray[np.bool_]: ...


@dataclass(frozen=True)
class Component:
    """Owned nodes of one velocity component, or of the pressure, on one level."""

    lattice: LevelGrid
    numbers: Indices  #: on this level, shape (owned,)
    dofs: Indices  #: their global unknowns, shape (owned,)

    @property
    def nodes(self) -> Indices:
        """Indices of their planes, shape (owned, dim)."""
        return self.lattice.indices(self.numbers)


@dataclass(frozen=True)
class Level:
    """All components, the pressure last; the global numbers of this process' unknowns start at `start`."""

    components: Sequence[Component]
    start: int
    owned: int

    def component_of(self) -> Indices:
        """Component of each owned unknown; unknowns without one have that of the pressure."""
        found = np.full(self.owned, len(self.components) - 1, dtype=np.int64)
        for number, component in enumerate(self.components):
            found[component.dofs - self.start] = number
        return found


def finest(unknowns: Unknowns) -> Level:
    """The finest level: the unknowns of the flow."""
    found: list[Component] = []
    grid = unknowns.grid
    corners = None if grid.sheets is None else vertices(grid.sheets, grid.nested)
    for nodes, degree in ((unknowns.velocity, unknowns.degree), (unknowns.pressure, 1)):
        copies = corners if grid.sheets is None or degree == 1 else second_degree(grid.sheets)
        planes = tuple(
            np.interp(np.arange(degree * (len(edge) - 1) + 1) / degree, np.arange(len(edge)), edge)
            for edge in grid.grid.edges
        )
        lattice = LevelGrid(planes, unknowns.periodic, grid.nested if degree == 1 else None, copies)
        numbers = nodes.numbers[: nodes.owned]
        found += [Component(lattice, numbers, unknowns.global_dofs[dofs]) for dofs in nodes.dofs[: nodes.owned].T]
    return Level(found, int(unknowns.index_map.local_range[0]) * unknowns.block_size, unknowns.owned)


def coarsen(comm: MPI.Comm, fine: Level, lattices: Sequence[LevelGrid]) -> Level:
    """A level on coarser lattices (collective).

    A node belongs to the process that owns it on the finer level. Unknowns are numbered point by point, in the order of
    the lattice.
    """
    kept, points = [], []
    for component, lattice in zip(fine.components, lattices, strict=True):
        numbers = component.numbers[component.numbers < component.lattice.size]
        finer = component.lattice.indices(numbers)
        nodes, own = np.empty_like(finer), np.ones(len(finer), dtype=bool)
        for axis, (some, every) in enumerate(zip(lattice.planes, component.lattice.planes, strict=True)):
            coordinate = every[finer[:, axis]]
            nodes[:, axis] = np.searchsorted(some, coordinate)
            own &= some[nodes[:, axis]] == coordinate
        own[own] = lattice.has(nodes[own])
        numbers = lattice.numbers(nodes[own])
        if lattice.copies is not None:
            further = np.flatnonzero(np.isin(lattice.copies.lowest, component.numbers))
            numbers = np.concatenate([numbers, lattice.size + further])
        kept.append(numbers)
        points.append(lattice.points(lattice.indices(numbers)))
    every = np.concatenate(points)
    number = np.empty(len(every), dtype=np.int64)
    number[np.lexsort((np.concatenate(kept), *every.T))] = np.arange(len(every))  # copies in one place, one by one
    start = comm.exscan(len(every)) or 0  # type: ignore[attr-defined]
    parts = np.split(start + number, np.cumsum([len(numbers) for numbers in kept])[:-1])
    components = [Component(*part) for part in zip(lattices, kept, parts, strict=True)]
    return Level(components, start, len(every))


def interpolation(comm: MPI.Comm, fine: Level, coarse: Level) -> PETSc.Mat:
    """P: values on the finer level from those on the coarser one (collective)."""
    rows, columns, data = [], [], []
    before: tuple[Component, LevelGrid] | None = None
    for here, there in zip(fine.components, coarse.components, strict=True):
        unknown = _everywhere(comm, there)
        if before is None or there.lattice is not before[1] or not _same_nodes(here, before[0]):
            nodes, parents, weights = _parents(here, there.lattice)
        before = here, there.lattice
        rows.append(here.dofs[nodes] - fine.start)
        columns.append(unknown[parents])
        data.append(weights)
    entries = (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns)))
    local = sparse.csr_matrix(entries, shape=(fine.owned, comm.allreduce(coarse.owned)))
    csr = (local.indptr.astype(PETSc.IntType), local.indices.astype(PETSc.IntType), local.data)
    return PETSc.Mat().createAIJ(((fine.owned, None), (coarse.owned, None)), csr=csr, comm=comm)


def _same_nodes(one: Component, other: Component) -> bool:
    """Whether two components of a level have the same nodes: interpolations to them are the same."""
    return one.lattice.shape == other.lattice.shape and np.array_equal(one.numbers, other.numbers)


def _parents(here: Component, coarser: LevelGrid) -> tuple[Indices, Indices, Array]:
    """Entries of the interpolation: (index of each node of a component, number on the coarser level, weight)."""
    nodes, parents, weights = coarser.interpolation(here.lattice.points(here.nodes))
    if coarser.copies is None:
        return nodes, parents, weights
    finer, parents, weights = coarser.copies.parents(here.numbers[nodes], parents, weights)
    order = np.argsort(here.numbers)
    return order[np.searchsorted(here.numbers, finer, sorter=order)], parents, weights


def _everywhere(comm: MPI.Comm, component: Component) -> Indices:
    """Global unknown of every node of a coarse lattice (collective)."""
    found = np.zeros(component.lattice.count, dtype=np.int64)
    found[component.numbers] = component.dofs
    return found if comm.size == 1 else comm.allreduce(found)


class Multigrid:
    """The levels of one flow, the same for all cuts, and preconditioners on them."""

    def __init__(
        self,
        comm: MPI.Comm,
        unknowns: Unknowns,
        cycle: PETSc.PC.MGCycleType = PETSc.PC.MGCycleType.V,
        *,
        smoothed: bool = False,
    ):
        """smoothed: smoothers of first degree are those that converge on stretched cells, too."""
        self.comm, self._second, self._kind, self._smoothed = comm, unknowns.degree > 1, cycle, smoothed
        self.levels = [finest(unknowns)]
        self._interpolations: list[PETSc.Mat] = []
        #: the finest matrix of the last preconditioner, and the coarse ones, reused while it, and thus its pattern,
        #: is the same
        self._last: PETSc.Mat | None = None
        self._smoothed_matrix: PETSc.Mat | None = None  #: that one with a larger diagonal behind surfaces
        self._coarse: list[CoarseMatrix] = []
        self._cycle: PETSc.PC | None = None
        self._multiplied = 0  #: handle of the matrix with which the cycle computes residuals on the finest level
        while comm.allreduce(self.levels[-1].owned) > COARSEST:
            lattices = [component.lattice for component in self.levels[-1].components]
            if lattices[-1].smallest:
                break
            finer_velocity = lattices[0].shape != lattices[-1].shape
            next_one = lattices[-1] if finer_velocity else lattices[-1].coarser()
            of_velocity = next_one
            if finer_velocity and (sheets := unknowns.grid.sheets) is not None and next_one.copies is not None:
                of_velocity = replace(next_one, copies=from_second_degree(sheets, next_one.copies))
            lattices = [*[of_velocity] * unknowns.dim, next_one]
            self.levels.append(coarsen(comm, self.levels[-1], lattices))
            self._interpolations.append(interpolation(comm, *self.levels[-2:]))

    def preconditioner(
        self,
        matrix: PETSc.Mat,
        held: NDArray[np.bool_],
        surfaces: Surfaces,
        product: PETSc.Mat | None = None,
        levels: Array | None = None,
    ) -> PETSc.PC:
        """One cycle for a matrix; it does not follow later changes (collective).

        With first degree the next call overwrites it if the pattern of the matrix is the same: subdomains and patterns
        of factors are found once. held: owned unknowns with rows of the identity; product: the matrix that
        multiplies vectors, None: `matrix`; levels: pressure levels that bodies determine, see `pinned`.
        """
        matrices, interpolations = self._galerkin(matrix, held)
        finest = product or matrix
        if finest.handle != self._multiplied:
            self._cycle = None  # PETSc's cycles compute residuals with the matrix of their first set-up
        self._multiplied = finest.handle
        cycle = self._cycle = self._cycle or self._new_cycle(interpolations)
        if self._second and interpolations:
            self._cycle = None  # the smoothers depend on where the surfaces are
            near = self._near_by_level(surfaces.dofs_near_surfaces() & ~held, interpolations[:-1])
            for level, marked in enumerate(reversed(near), 1):
                self._solve_near_surfaces(cycle.getMGSmoother(level), marked)
        for level, (here, of) in enumerate(zip(reversed(self.levels), reversed(matrices), strict=True)):
            smoother = cycle.getMGSmoother(level)
            if level == 0:
                smoother.reset()  # the pivots of LU factors may depend on those before
                smoother.setOperators(of if levels is None else pinned(of, levels, interpolations))
            else:
                smoother.getPC().setReusePreconditioner(False)
                if self._second:
                    factored = decoupled(of, here.component_of())
                else:
                    factored = self._for_smoother(of, surfaces.dofs_behind_surfaces() & ~held) if of is matrix else of
                smoother.setOperators(finest if of is matrix else of, factored)
        cycle.setUseAmat(True)  # PETSc gives the finest smoother the operators of the cycle
        cycle.setOperators(finest, matrix)
        cycle.setUp()
        for level in range(len(matrices)):
            smoother = cycle.getMGSmoother(level)
            smoother.setUp()
            smoother.getPC().setReusePreconditioner(True)
        cycle.setReusePreconditioner(True)
        return cycle

    def _for_smoother(self, matrix: PETSc.Mat, behind: NDArray[np.bool_]) -> PETSc.Mat:
        """The finest matrix of first degree, whose rows dominate where the flow is only extended to.

        Those rows are differences of fourth order. With second degree such nodes are no unknowns.
        """
        changed = self._smoothed_matrix
        if changed is None and not self.comm.allreduce(bool(behind.any()), op=MPI.LOR):
            return matrix
        if changed is None:
            changed = self._smoothed_matrix = matrix.duplicate(copy=True)
        else:
            matrix.copy(changed, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        starts, _, entries = matrix.getValuesCSR()
        added = changed.createVecs()[0]
        sums = np.add.reduceat(np.abs(entries), starts[:-1])  # every row has its diagonal
        added.array[:] = np.where(behind, BEHIND * sums, 0.0)
        changed.setDiagonal(changed.getDiagonal() + added)
        return changed

    def _new_cycle(self, interpolations: Sequence[PETSc.Mat]) -> PETSc.PC:
        cycle, count = PETSc.PC().create(self.comm), len(self.levels)
        cycle.setType(PETSc.PC.Type.MG)
        cycle.setMGLevels(count)
        cycle.setMGCycleType(self._kind)
        for level in range(1, count):
            cycle.setMGInterpolation(level, interpolations[count - 1 - level])
        for level in range(count):
            smoother = cycle.getMGSmoother(level)
            smoother.setNormType(PETSc.KSP.NormType.NONE)
            if level == 0:
                smoother.setType(PETSc.KSP.Type.PREONLY)
                smoother.getPC().setType(PETSc.PC.Type.LU)
                smoother.getPC().setFactorSolverType("mumps")
            else:
                self._smooth(smoother)
        return cycle

    def _smooth(self, smoother: PETSc.KSP) -> None:
        """Smoother: incomplete factors on each process with one layer of overlap, which halves the time.

        A single step with them diverges on stretched cells, and where convection is strong on nested ones.
        """
        prefix = "flow_second_" if self._second else "flow_first_"
        smoother.setOptionsPrefix(prefix)
        if self._second:
            # without reordering there are 20 iterations instead of 13
            options = incomplete_factors(self.comm, sub_pc_factor_mat_ordering_type="rcm")
        else:
            options = incomplete_factors(self.comm, **BLOCKS)
        if self._second or self._smoothed:
            smoother.setType(PETSc.KSP.Type.GMRES)
            smoother.setTolerances(max_it=2)
        else:
            smoother.setType(PETSc.KSP.Type.RICHARDSON)
            smoother.setTolerances(max_it=1)
        for name, value in options.items():
            PETSc.Options(prefix)[name] = value
        smoother.getPC().setFromOptions()

    def _near_by_level(self, near: NDArray[np.bool_], interpolations: list[PETSc.Mat]) -> list[NDArray[np.bool_]]:
        """Unknowns near surfaces by level, finest first: those on which finer ones depend (collective)."""
        found = [near]
        for P in interpolations:
            coarse, fine = P.createVecs()
            fine.array[:] = found[-1]
            P.multTranspose(fine, coarse)
            found.append(coarse.array > 0.0)
        return found

    def _solve_near_surfaces(self, smoother: PETSc.KSP, near: NDArray[np.bool_]) -> None:
        """Let a smoother have exact factors of marked owned unknowns, incomplete ones of others (collective)."""
        if not self.comm.allreduce(bool(near.any()), op=MPI.LOR):
            return
        both = PETSc.PC().create(self.comm)
        both.setType(PETSc.PC.Type.PYTHON)
        both.setPythonContext(NearSmoother(smoother.getPC(), near))
        smoother.setPC(both)

    def _galerkin(self, matrix: PETSc.Mat, held: NDArray[np.bool_]) -> tuple[list[PETSc.Mat], list[PETSc.Mat]]:
        """Matrices and interpolations, finest first (collective)."""
        matrices, interpolations, free = [matrix], [], (~held).astype(float)
        if self._last is None or self._last.handle != matrix.handle:
            self._last, self._smoothed_matrix = matrix, None
            self._coarse, self._cycle = [CoarseMatrix(level) for level in self._interpolations], None
        for coarse in self._coarse:
            interpolations.append(coarse.mark(free))
            matrices.append(coarse.update(matrices[-1], free))
            free = coarse.free
        return matrices, interpolations
