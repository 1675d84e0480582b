"""The matrix of the flow: unknowns of active cells, coupled within cells and across ghost faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy import sparse

from solvers import fem
from solvers.fluid.cut import Cut
from solvers.fluid.space import Unknowns


@dataclass(frozen=True)
class Pattern:
    """Allocated couplings of a matrix: within cells and across faces of this process."""

    cells: NDArray[np.bool_]  #: per local cell
    faces: NDArray[np.bool_]  #: per local face with two cells, in the order of `interior_faces`
    reach: NDArray[np.bool_]  #: per local cell: all its faces with cells of the pattern belong to it
    by_faces: bool  #: couplings across faces are wanted

    def covers(self, cut: Cut, faces: NDArray[np.int32]) -> bool:
        """A cut needs no more than this."""
        wanted = self.faces[np.searchsorted(faces, cut.ghost_faces)] if self.by_faces else np.True_
        return bool(self.cells[cut.active].all() and wanted.all())


def choose_pattern(unknowns: Unknowns, cut: Cut, *, by_faces: bool) -> Pattern:
    """A sparsity pattern for a cut and for those that its bodies may make in the next steps."""
    cells = cut.reach.copy()
    cells[cut.active] = True
    faces, sides = unknowns.grid.interior_faces
    cells[sides[np.searchsorted(faces, cut.ghost_faces)]] = True
    return pattern_of(unknowns, cells, cut.reach, by_faces=by_faces)


def pattern_of(unknowns: Unknowns, cells: NDArray[np.bool_], reach: NDArray[np.bool_], *, by_faces: bool) -> Pattern:
    """Some local cells, and the faces between them of those in reach of a body."""
    _, sides = unknowns.grid.interior_faces
    faces = reach[sides].any(axis=1) & cells[sides].all(axis=1) & by_faces
    return Pattern(cells, faces, reach, by_faces)


def fits(unknowns: Unknowns, pattern: Pattern | None, cut: Cut) -> bool:
    """The pattern contains the couplings of a cut on every process (collective)."""
    faces, _ = unknowns.grid.interior_faces
    return unknowns.grid.comm.allreduce(pattern is not None and pattern.covers(cut, faces), op=MPI.LAND)


def create_matrix(
    unknowns: Unknowns, pattern: Pattern, more: NDArray[np.int64] | None = None, *, blocked: bool
) -> PETSc.Mat:
    """An empty matrix with the entries of a pattern and `more` in owned rows; blocked: in dense blocks (collective)."""
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


def _neighbours(unknowns: Unknowns, pattern: Pattern, local: int) -> NDArray[np.int64]:
    """Blocks that each local block is coupled with, by what this process holds."""
    blocks = unknowns.cell_blocks
    _, sides = unknowns.grid.interior_faces
    cells = blocks[pattern.cells]
    pairs = blocks[sides[pattern.faces]].reshape(-1, 2 * blocks.shape[1])
    columns = np.concatenate([cells.ravel(), pairs.ravel()])
    lengths = np.concatenate([np.full(len(cells), blocks.shape[1]), np.full(len(pairs), 2 * blocks.shape[1])])
    starts = np.concatenate([[0], np.cumsum(lengths)])
    incidence = sparse.csr_matrix((np.ones(len(columns), dtype=np.int32), columns, starts), shape=(len(lengths), local))
    return np.diff((incidence.T @ incidence).tocsr().indptr)
