"""The table of the fluid in cut cells."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices


class CellState(IntEnum):
    """All fluid and no surface, all solid, or with surface in it or in its faces."""

    FLUID = 0
    SOLID = 1
    CUT = 2


@dataclass(frozen=True)
class CutTable:
    """Regions of fluid in cut cells, what bounds them, and how they are linked; C cells, R regions, P pieces, F parts.

    A region is a connected part of the fluid in one cut cell. Cells are numbered i + nx (j + ny k). L_q is the Lagrange
    basis on the tensor points of a cell, the first direction fastest; lambda_v are the barycentric coordinates of a
    facet.
    """

    shape: tuple[int, ...]  #: cells in each direction
    quantum: float  #: vertices and grid lines are multiples of it [m], seen from the first corner of the box
    vertices: Array  #: rounded, relative to the first corner of the box [m], shape (vertices, dim)
    state: NDArray[np.int8]  #: CellState, shape (C,)
    exact: NDArray[np.bool_]  #: cells of the exact kernel, shape (C,)

    # Regions, sorted by cell
    cell: Indices  #: shape (R,)
    share: Array  #: volume / volume of the cell, shape (R,)
    moments: Array  #: int L_q / volume of the cell, shape (R, n^dim)

    # Pieces of surface, sorted by region and facet: the part of one facet that bounds one region
    piece_region: Indices  #: shape (P,)
    piece_facet: Indices  #: shape (P,)
    piece_body: Indices  #: shape (P,)
    piece_moments: Array  #: int L_q lambda_v [m^(dim - 1)], shape (P, n^dim, dim)

    # Parts of faces that are open from a region to what is on the other side
    face_axis: Indices  #: normal of the face, shape (F,)
    face_cells: Indices  #: cells below and above the face, -1: outside of the box, shape (F, 2)
    face_regions: Indices  #: regions below and above, -1: that cell is not cut, all fluid or outside, shape (F, 2)
    face_area: Array  #: relative to the face, shape (F,)
    face_moments: Array  #: int L_q of the face / its area, the lower one of its axes fastest, shape (F, n^(dim - 1))

    # Parts of facets that others touch, sorted by cell and facet: the gap is at most the closing length
    closed_cell: Indices  #: shape (K,)
    closed_facet: Indices  #: shape (K,)
    closed_moments: Array  #: int L_q lambda_v [m^(dim - 1)], shape (K, n^dim, dim)

    @property
    def piece_area(self) -> Array:
        """Area of the pieces [m^(dim - 1)], shape (P,)."""
        return np.asarray(self.piece_moments.sum(axis=(1, 2)))
