"""The sparsity pattern of the flow's matrix: couplings within active cells and across ghost faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy import sparse

from solvers import fem
from solvers.fluid.cut.cut import Cut
from solvers.fluid.mesh.space import Unknowns


@dataclass(frozen=True)
class Pattern:
    """Allocated couplings of a matrix, for the cells and faces of this process."""

    cells: NDArray[np.bool_]  #: local cells with couplings within them
    faces: NDArray[np.bool_]  #: interior faces with couplings across them, in the order of `find_interior_faces`
    reach: NDArray[np.bool_]  #: local cells whose faces with other cells of the pattern have couplings
    by_faces: bool  #: whether the cut penalty has couplings across faces

    def covers(self, cut: Cut, faces: NDArray[np.int32]) -> bool:
        """Whether the pattern contains all couplings of a cut on this process; faces: `find_interior_faces`."""
        needed = self.faces[np.searchsorted(faces, cut.ghost_faces)] if self.by_faces else np.True_
        return bool(self.cells[cut.active].all() and needed.all())


def choose_pattern(unknowns: Unknowns, cut: Cut, *, by_faces: bool) -> Pattern:
    """A sparsity pattern for a cut and for the cuts of the next steps, which the motion of its bodies may cause."""
    cells = cut.reach.copy()
    cells[cut.active] = True
    faces, sides = unknowns.grid.find_interior_faces()
    cells[sides[np.searchsorted(faces, cut.ghost_faces)]] = True
    return pattern_of(unknowns, cells, cut.reach, by_faces=by_faces)


def pattern_of(unknowns: Unknowns, cells: NDArray[np.bool_], reach: NDArray[np.bool_], *, by_faces: bool) -> Pattern:
    """The pattern of some local cells; reach: cells whose faces with others have couplings, if `by_faces`."""
    _, sides = unknowns.grid.find_interior_faces()
    faces = reach[sides].any(axis=1) & cells[sides].all(axis=1) & by_faces
    return Pattern(cells, faces, reach, by_faces)


def fits(unknowns: Unknowns, pattern: Pattern | None, cut: Cut) -> bool:
    """Whether the pattern contains the couplings of a cut on every process (collective)."""
    faces, _ = unknowns.grid.find_interior_faces()
    return unknowns.grid.comm.allreduce(pattern is not None and pattern.covers(cut, faces), op=MPI.LAND)


def create_matrix(
    unknowns: Unknowns, pattern: Pattern, more: NDArray[np.int64] | None = None, *, blocked: bool
) -> PETSc.Mat:
    """Allocate an empty matrix (collective).

    more: count of entries in each owned row in addition to those of the pattern; blocked: store dense blocks.
    """
    size = unknowns.block_size
    index_map = unknowns.index_map
    owned, local = int(index_map.size_local), int(index_map.size_local + index_map.num_ghosts)
    neighbours = _neighbours(unknowns, pattern, local)
    total = np.maximum(fem.sum_ghosts(unknowns.space, neighbours.astype(float)), 1.0)[:owned].astype(np.int64)
    comm = unknowns.grid.comm
    rows_global = int(index_map.size_global) * size
    matrix = PETSc.Mat().create(comm)
    matrix.setSizes(((owned * size, rows_global), (owned * size, rows_global)))
    matrix.setBlockSize(size)
    matrix.setType(PETSc.Mat.Type.BAIJ if blocked else PETSc.Mat.Type.AIJ)
    ghosts = np.asarray(index_map.ghosts)
    start = int(index_map.local_range[0])
    numbers = np.concatenate([np.arange(start, start + owned), ghosts]).astype(PETSc.IntType)
    mapping = PETSc.LGMap().create(numbers, bsize=size, comm=comm)
    matrix.setLGMap(mapping, mapping)
    if blocked:
        total += 0 if more is None else more.reshape(owned, size).max(axis=1)
    else:
        total = np.repeat(total * size, size) + (0 if more is None else more)
    unit = 1 if blocked else size
    inside = np.minimum(total, owned * unit).astype(PETSc.IntType)
    outside = np.minimum(total, (int(index_map.size_global) - owned) * unit).astype(PETSc.IntType)
    matrix.setPreallocationNNZ((inside, outside) if comm.size > 1 else inside)
    matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    matrix.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
    return matrix


def quick_copy(matrix: PETSc.Mat) -> PETSc.Mat:
    """A copy of an assembled matrix, which is destroyed (collective).

    The copy multiplies vectors 4 times as fast (Intel Xeon of 2024, PETSc 3.18): it uses BLAS, the original a kernel
    whose loads of blocks bypass the caches. And it has no room for entries that were not set.
    """
    copy = matrix.duplicate(copy=True)
    matrix.destroy()
    copy.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
    copy.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    return copy


def _neighbours(unknowns: Unknowns, pattern: Pattern, local: int) -> NDArray[np.int64]:
    """Count of blocks that each local block is coupled with by cells and faces of this process."""
    blocks = unknowns.cell_blocks
    _, sides = unknowns.grid.find_interior_faces()
    cells = blocks[pattern.cells]
    pairs = blocks[sides[pattern.faces]].reshape(-1, 2 * blocks.shape[1])
    columns = np.concatenate([cells.ravel(), pairs.ravel()])
    lengths = np.concatenate([np.full(len(cells), blocks.shape[1]), np.full(len(pairs), 2 * blocks.shape[1])])
    starts = np.concatenate([[0], np.cumsum(lengths)])
    incidence = sparse.csr_matrix((np.ones(len(columns), dtype=np.int32), columns, starts), shape=(len(lengths), local))
    return np.diff((incidence.T @ incidence).tocsr().indptr)
