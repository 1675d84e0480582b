"""Connected components of the fluid of the whole box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.csgraph import connected_components

from solvers.api import Indices
from solvers.cut_cells.table import CellState, CutTable


@dataclass(frozen=True)
class Components:
    """Fluid that is connected has one number."""

    count: int
    of_region: Indices  #: shape (regions,)
    of_cell: Indices  #: of cells that are all fluid, -1: others, shape (cells,)


def components_of(table: CutTable) -> Components:
    """Components over the open parts of faces; cells that are all fluid are linked to each other."""
    regions = len(table.cell)
    label, labels = ndimage.label((table.state == CellState.FLUID).reshape(table.shape, order="F"))
    number = np.where(label > 0, regions + label - 1, -1).ravel(order="F").astype(np.int64)
    beside = np.where(table.face_cells >= 0, number[table.face_cells], -1)
    ends = np.where(table.face_regions >= 0, table.face_regions, beside)
    ends = ends[(ends >= 0).all(axis=1)]
    size = regions + int(labels)
    graph = sparse.coo_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(size, size))
    count, of = connected_components(graph, directed=False)
    of = of.astype(np.int64)
    return Components(int(count), of[:regions], np.where(number >= 0, np.append(of, -1)[number], -1))
