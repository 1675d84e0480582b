"""Terms of surfaces that are linear in the flow, as dense blocks of cut cells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array

#: Pieces that are evaluated together. Arrays at their quadrature points are large in 3D.
PIECES_AT_ONCE = 256


@dataclass(frozen=True)
class CellBlocks:
    """A matrix B as a sum of dense blocks, one per cell."""

    dofs: NDArray[np.int32]  #: local, shape (cells, n)
    blocks: Array  #: shape (cells, n, n)

    def rows(self, flow: Array) -> Array:
        """B w for a flow w, at local dofs; contributions to ghosts are not added up."""
        found = np.einsum("cab,cb->ca", self.blocks, flow[self.dofs])
        return np.bincount(self.dofs.ravel(), found.ravel(), len(flow)).astype(float)

    def __iter__(self) -> Iterator[tuple[NDArray[np.int32], Array]]:
        return zip(self.dofs, self.blocks, strict=True)


def cell_blocks(cells: NDArray[np.int32], dofs: NDArray[np.int32], by_piece: Array) -> CellBlocks:
    """Sum the blocks of pieces, sorted by cell, to those of cells.

    dofs: (pieces, ...), with any shape of the functions of a cell; by_piece: (pieces, ..., ...).
    """
    first = np.unique(cells, return_index=True)[1]
    size = int(np.prod(dofs.shape[1:]))
    dofs, blocks = dofs.reshape(len(dofs), size), by_piece.reshape(len(dofs), size, size)
    if len(first):
        blocks = np.add.reduceat(blocks, first, axis=0)
    return CellBlocks(dofs[first].astype(np.int32), blocks)


def by_functions(area: Array, table: tuple[Array, Array], coefficients: Array, sizes: Array) -> Array:
    """int sum_fg c_fkgl F_fa F_gb by pieces with F = (phi, grad phi), shape (pieces, functions, k, functions, l).

    area: int L_q, (pieces, points); table: values (points, functions) and reference gradients (points, functions, dim)
    at these points; coefficients: c, (pieces, fields, k, fields, l); sizes: edge lengths of cells [m], (pieces, dim).
    """
    (pieces, _, size), (points, functions) = coefficients.shape[:3], table[0].shape
    F = np.concatenate([table[0][None], np.moveaxis(table[1], 2, 0)])
    scale = np.concatenate([np.ones((pieces, 1)), 1.0 / sizes], axis=1)
    c = coefficients * scale[:, :, None, None, None] * scale[:, None, None, :, None]
    f, g = np.nonzero(c.any(axis=(0, 2, 4)))
    pairs = np.einsum("fqa,fqb->qfab", F[f], F[g]).reshape(points, len(f) * functions**2)
    block = np.zeros((pieces, functions, size, functions, size))
    gives = np.flatnonzero(c.any(axis=(1, 2, 3, 4)))
    for some in (gives[first : first + PIECES_AT_ONCE] for first in range(0, len(gives), PIECES_AT_ONCE)):
        moments = (area[some] @ pairs).reshape(len(some), len(f), functions**2)
        of_pairs = c[some][:, f, :, g].transpose(1, 2, 3, 0).reshape(len(some), size**2, len(f))
        found = (of_pairs @ moments).reshape(len(some), size, size, functions, functions)
        block[some] = found.transpose(0, 3, 1, 4, 2)
    return block
