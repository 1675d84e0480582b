"""The matrix of the flow: unknowns of active cells, coupled within cells and across ghost faces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy import sparse

from solvers import fem
from solvers.fluid.cut import Cut
from solvers.fluid.space import Unknowns


def create_matrix(unknowns: Unknowns, cut: Cut, face_cells: NDArray[np.int32]) -> PETSc.Mat:
    """An empty matrix with room for the couplings of a cut; `face_cells` are the two cells of each ghost face."""
    size = unknowns.block_size
    index_map = unknowns.index_map
    owned, local = int(index_map.size_local), int(index_map.size_local + index_map.num_ghosts)
    neighbours = _neighbours(unknowns, cut, face_cells, local)
    total = np.maximum(fem.sum_ghosts(unknowns.space, neighbours.astype(float)), 1.0).astype(np.int64)
    comm = unknowns.grid.comm
    rows_global = int(index_map.size_global) * size
    matrix = PETSc.Mat().create(comm)
    matrix.setSizes(((owned * size, rows_global), (owned * size, rows_global)))
    matrix.setBlockSize(size)
    matrix.setType(PETSc.Mat.Type.AIJ)
    ghosts = np.asarray(index_map.ghosts)
    start = int(index_map.local_range[0])
    numbers = np.concatenate([np.arange(start, start + owned), ghosts]).astype(PETSc.IntType)
    mapping = PETSc.LGMap().create(numbers, bsize=size, comm=comm)
    matrix.setLGMap(mapping, mapping)
    room = np.repeat(total[:owned] * size, size)
    inside = np.minimum(room, owned * size).astype(PETSc.IntType)
    outside = np.minimum(room, rows_global - owned * size).astype(PETSc.IntType)
    matrix.setPreallocationNNZ((inside, outside) if comm.size > 1 else inside)
    matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    matrix.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
    return matrix


def _neighbours(unknowns: Unknowns, cut: Cut, face_cells: NDArray[np.int32], local: int) -> NDArray[np.int64]:
    """Blocks that each local block is coupled with, by what this process holds."""
    blocks = unknowns.cell_blocks
    groups = [blocks[cut.active]]
    pairs = blocks[face_cells].reshape(len(face_cells), 2 * blocks.shape[1])
    columns = np.concatenate([groups[0].ravel(), pairs.ravel()])
    lengths = np.concatenate([np.full(len(groups[0]), blocks.shape[1]), np.full(len(pairs), 2 * blocks.shape[1])])
    starts = np.concatenate([[0], np.cumsum(lengths)])
    incidence = sparse.csr_matrix((np.ones(len(columns), dtype=np.int32), columns, starts), shape=(len(lengths), local))
    return np.diff((incidence.T @ incidence).tocsr().indptr)
