"""Geometric multigrid for the flow: the planes of the grid are thinned out level by level.

The nodes of velocity and pressure are lattices, products of planes. A coarse lattice keeps some of the planes; values
between them follow by multilinear interpolation P, coarse matrices are P^T A P. Held unknowns, those without fluid
among them, get no correction. The first coarse lattice of a velocity of second degree is that of the vertices.
Source: Trottenberg, Oosterlee, Schuller, Multigrid (2001), sections 2.4, 5.1 and 8.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy import sparse

from solvers.api import Array
from solvers.fluid.decoupled import decoupled
from solvers.fluid.space import Unknowns
from solvers.linear import ZERO_PIVOT

Indices = NDArray[np.int64]

#: Unknowns below which a level is solved directly, in less time than the levels above take to smooth.
COARSEST = 2_000
#: A level has at most this share of the nodes of the next finer one.
THINNER = 0.6


@dataclass(frozen=True)
class LevelGrid:
    """Planes [m] per direction; along a periodic axis the last plane is the first."""

    planes: tuple[Array, ...]
    periodic: tuple[int, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(some) - (axis in self.periodic) for axis, some in enumerate(self.planes))

    def coarser(self) -> LevelGrid:
        """Neighbouring cells are joined where they are smallest.

        A pair becomes one cell if that is no wider than H, the same for all directions: stretched cells are joined
        across their short edges first. H is doubled until less than THINNER of the nodes is left.
        """
        width = 2.0 * min(float(np.diff(some).min()) for some in self.planes)
        while True:
            found = LevelGrid(tuple(_join(some, width * (1.0 + 1e-6)) for some in self.planes), self.periodic)
            if found.smallest or np.prod(found.shape) <= THINNER * np.prod(self.shape):
                return found
            width *= 2.0

    @property
    def smallest(self) -> bool:
        """A single cell."""
        return all(len(some) == 2 for some in self.planes)


def _join(planes: Array, width: float) -> Array:
    kept, i = [0], 0
    while i < len(planes) - 1:
        i += 2 if i + 2 < len(planes) and planes[i + 2] - planes[i] <= width else 1
        kept.append(i)
    return planes[kept]


@dataclass(frozen=True)
class Component:
    """Owned nodes of one velocity component, or of the pressure, on one level."""

    lattice: LevelGrid
    nodes: Indices  #: their planes, shape (owned, dim)
    dofs: Indices  #: their global unknowns

    @property
    def numbers(self) -> Indices:
        return np.ravel_multi_index(tuple(self.nodes.T), self.lattice.shape, order="F").astype(np.int64)


@dataclass(frozen=True)
class Level:
    """All components, the pressure last; the global numbers of this process' unknowns start at `start`."""

    components: Sequence[Component]
    start: int
    owned: int

    def component_of(self) -> Indices:
        """Component of each owned unknown; those of no component count as pressures."""
        found = np.full(self.owned, len(self.components) - 1, dtype=np.int64)
        for number, component in enumerate(self.components):
            found[component.dofs - self.start] = number
        return found


def finest(unknowns: Unknowns) -> Level:
    """The unknowns of the flow as they are."""
    found = []
    for nodes, degree in ((unknowns.velocity, unknowns.degree), (unknowns.pressure, 1)):
        planes = tuple(
            np.interp(np.arange(degree * (len(edge) - 1) + 1) / degree, np.arange(len(edge)), edge)
            for edge in unknowns.grid.grid.edges
        )
        lattice = LevelGrid(planes, unknowns.periodic)
        index = np.stack(np.unravel_index(nodes.numbers[: nodes.owned], lattice.shape, order="F"), axis=1)
        found += [Component(lattice, index, unknowns.global_dofs[dofs]) for dofs in nodes.dofs[: nodes.owned].T]
    return Level(found, int(unknowns.index_map.local_range[0]) * unknowns.block_size, unknowns.owned)


def coarsen(comm: MPI.Comm, fine: Level, lattices: Sequence[LevelGrid]) -> Level:
    """A level on coarser lattices; a node belongs to the process that has it on the finer one (collective).

    Unknowns at one point are neighbours, points in the order of the lattice.
    """
    kept, points = [], []
    for component, lattice in zip(fine.components, lattices, strict=True):
        nodes, own = np.empty_like(component.nodes), np.ones(len(component.nodes), dtype=bool)
        for axis, (some, every) in enumerate(zip(lattice.planes, component.lattice.planes, strict=True)):
            place = every[component.nodes[:, axis]]
            nodes[:, axis] = np.searchsorted(some, place)
            own &= some[nodes[:, axis]] == place
        kept.append(nodes[own])
        points.append(np.stack([some[i] for some, i in zip(lattice.planes, nodes[own].T, strict=True)], axis=1))
    every = np.concatenate(points)
    number = np.empty(len(every), dtype=np.int64)
    number[np.lexsort(every.T)] = np.arange(len(every))
    start = comm.exscan(len(every)) or 0  # type: ignore[attr-defined]
    parts = np.split(start + number, np.cumsum([len(nodes) for nodes in kept])[:-1])
    components = [Component(*part) for part in zip(lattices, kept, parts, strict=True)]
    return Level(components, start, len(every))


def interpolation(comm: MPI.Comm, fine: Level, coarse: Level) -> PETSc.Mat:
    """P: values on the finer level from those on the coarser one (collective)."""
    rows, columns, data = [], [], []
    for here, there in zip(fine.components, coarse.components, strict=True):
        unknown = _everywhere(comm, there)
        pairs = [_weights(a, b) for a, b in zip(here.lattice.planes, there.lattice.planes, strict=True)]
        shape = there.lattice.shape
        for corner in np.ndindex(*(2,) * len(pairs)):
            parents = [
                (first[i] + c) % n for (first, _), i, c, n in zip(pairs, here.nodes.T, corner, shape, strict=True)
            ]
            parts = [weight[i, c] for (_, weight), i, c in zip(pairs, here.nodes.T, corner, strict=True)]
            weight = np.prod(parts, axis=0)
            used = weight > 0.0
            rows.append(here.dofs[used] - fine.start)
            columns.append(unknown[np.ravel_multi_index(parents, shape, order="F")[used]])
            data.append(weight[used])
    place = (np.concatenate(rows), np.concatenate(columns))
    local = sparse.csr_matrix((np.concatenate(data), place), shape=(fine.owned, comm.allreduce(coarse.owned)))
    csr = (local.indptr.astype(PETSc.IntType), local.indices.astype(PETSc.IntType), local.data)
    return PETSc.Mat().createAIJ(((fine.owned, None), (coarse.owned, None)), csr=csr, comm=comm)


def _everywhere(comm: MPI.Comm, component: Component) -> Indices:
    """Unknown of every node of a coarse lattice, once for all cuts (collective)."""
    found = np.zeros(int(np.prod(component.lattice.shape)), dtype=np.int64)
    found[component.numbers] = component.dofs
    return found if comm.size == 1 else comm.allreduce(found)


def _weights(fine: Array, coarse: Array) -> tuple[Indices, Array]:
    """(first coarse plane, weights of it and the next one) of each fine plane."""
    first = np.clip(np.searchsorted(coarse, fine, side="right") - 1, 0, len(coarse) - 2)
    second = (fine - coarse[first]) / (coarse[first + 1] - coarse[first])
    return first, np.stack([1.0 - second, second], axis=1)


class Multigrid:
    """The levels of one flow, the same for all cuts, and preconditioners on them."""

    def __init__(self, comm: MPI.Comm, unknowns: Unknowns):
        self.comm, self._second = comm, unknowns.degree > 1
        self.levels = [finest(unknowns)]
        self._interpolations: list[PETSc.Mat] = []
        #: the finest matrix that a preconditioner was made for last, what it was converted to, and by levels the
        #: interpolation and the coarse matrix: while that matrix is in use, its pattern stays
        self._last: PETSc.Mat | None = None
        self._converted: PETSc.Mat | None = None
        self._kept: list[tuple[PETSc.Mat, PETSc.Mat]] = []
        while comm.allreduce(self.levels[-1].owned) > COARSEST:
            lattices = [component.lattice for component in self.levels[-1].components]
            if lattices[-1].smallest:
                break
            finer_velocity = lattices[0].shape != lattices[-1].shape
            next_one = lattices[-1] if finer_velocity else lattices[-1].coarser()
            self.levels.append(coarsen(comm, self.levels[-1], [next_one] * len(lattices)))
            self._interpolations.append(interpolation(comm, *self.levels[-2:]))

    def set_up(self, preconditioner: PETSc.PC, matrix: PETSc.Mat, held: NDArray[np.bool_]) -> None:
        """Make a preconditioner one V-cycle for a matrix; it stays what it is when the matrix changes (collective).

        It takes the place of the one before, whose matrices are overwritten.
        held: owned unknowns whose rows are those of the identity.
        """
        matrices, interpolations = self._galerkin(matrix, held)
        count = len(matrices)
        preconditioner.setType(PETSc.PC.Type.MG)
        preconditioner.setMGLevels(count)
        for level in range(1, count):
            preconditioner.setMGInterpolation(level, interpolations[count - 1 - level])
        for level in range(count):
            smoother = preconditioner.getMGSmoother(level)
            smoother.setOperators(matrices[count - 1 - level])
            smoother.setNormType(PETSc.KSP.NormType.NONE)
            if level == 0:
                smoother.setType(PETSc.KSP.Type.PREONLY)
                smoother.getPC().setType(PETSc.PC.Type.LU)
                smoother.getPC().setFactorSolverType("mumps")
            else:
                self._smooth(smoother, matrices[count - 1 - level], self.levels[count - 1 - level])
        preconditioner.setUp()
        for level in range(count):
            smoother = preconditioner.getMGSmoother(level)
            smoother.setUp()
            smoother.getPC().setReusePreconditioner(True)
        preconditioner.setReusePreconditioner(True)

    def _smooth(self, smoother: PETSc.KSP, matrix: PETSc.Mat, level: Level) -> None:
        """Incomplete factors by process, with a layer of its neighbours: without that it takes twice as long."""
        prefix = "flow_second_" if self._second else "flow_first_"
        PETSc.Options(prefix)["sub_pc_type"] = "ilu"
        PETSc.Options(prefix)["sub_pc_factor_zeropivot"] = ZERO_PIVOT
        smoother.setOptionsPrefix(prefix)
        if self._second:
            # one step alone would diverge on stretched cells; in the given order it takes 20 iterations instead of 13
            PETSc.Options(prefix)["sub_pc_factor_mat_ordering_type"] = "rcm"
            smoother.setType(PETSc.KSP.Type.GMRES)
            smoother.setTolerances(max_it=2)
            smoother.setOperators(matrix, decoupled(matrix, level.component_of()))
        else:
            smoother.setType(PETSc.KSP.Type.RICHARDSON)
            smoother.setTolerances(max_it=1)
        smoother.getPC().setType(PETSc.PC.Type.ASM if self.comm.size > 1 else PETSc.PC.Type.BJACOBI)
        smoother.getPC().setFromOptions()

    def _galerkin(self, matrix: PETSc.Mat, held: NDArray[np.bool_]) -> tuple[list[PETSc.Mat], list[PETSc.Mat]]:
        """Matrices and interpolations, finest first (collective)."""
        matrices, interpolations, free = [matrix], [], (~held).astype(float)
        if self._last is None or self._last.handle != matrix.handle:
            self._last, self._converted, self._kept = matrix, None, []
        product = matrix
        if "baij" in matrix.getType():
            product = self._converted = matrix.convert(PETSc.Mat.Type.AIJ, self._converted or PETSc.Mat())
        for number, level in enumerate(self._interpolations):
            P, known = self._kept[number] if number < len(self._kept) else (level.copy(), None)
            level.copy(P, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
            coarse, fine = P.createVecs()
            fine.array[:] = free
            P.diagonalScale(fine, None)
            P.multTranspose(fine, coarse)
            free = (coarse.array > 0.0).astype(float)
            product = product.ptap(P, result=known)
            if known is None:
                self._kept.append((P, product))
            coarse.array[:] = 1.0 - free  # coarse unknowns that correct nothing get rows of the identity
            product.setDiagonal(coarse, addv=PETSc.InsertMode.ADD_VALUES)
            product.assemble()
            matrices.append(product)
            interpolations.append(P)
        return matrices, interpolations
