"""Terms of surfaces that are linear in the flow, as dense blocks of cut cells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array


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
