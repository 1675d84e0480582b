"""The matrix of the flow: unknowns of cells with fluid, those of dependent nodes by their combinations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy import sparse

from solvers import fem
from solvers.fluid.space import Unknowns

Cells = NDArray[np.int32]
Counts = NDArray[np.int64]


def create_matrix(unknowns: Unknowns, cells: Cells, more: Counts | None = None, *, blocked: bool) -> PETSc.Mat:
    """An empty matrix with room for couplings within local cells and for `more` entries in owned rows (collective).

    blocked: by dense blocks of the unknowns of a node.
    """
    size, index_map, comm = unknowns.block_size, unknowns.index_map, unknowns.grid.comm
    owned, local = int(index_map.size_local), int(index_map.size_local + index_map.num_ghosts)
    neighbours = _neighbours(unknowns, cells, local)
    total = np.maximum(fem.sum_ghosts(unknowns.space, neighbours.astype(float)), 1.0)[:owned].astype(np.int64)
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


def _neighbours(unknowns: Unknowns, cells: Cells, local: int) -> Counts:
    """Blocks that each local block is coupled with, by what this process holds."""
    blocks = unknowns.cell_blocks[cells]
    starts = np.arange(len(blocks) + 1) * blocks.shape[1]
    entries = (np.ones(blocks.size, dtype=np.int32), blocks.ravel(), starts)
    incidence = sparse.csr_matrix(entries, shape=(len(blocks), local))
    return np.diff((incidence.T @ incidence).tocsr().indptr)
