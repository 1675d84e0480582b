"""The mesh of one body as plain arrays, from shapes or mesh files."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Mesh:
    """One cell type, first or second order, with named surfaces and regions.

    Node order within a cell is VTK's (as meshio and pyvista use it).
    """

    points: NDArray[np.float64]  #: node positions [m], shape (n, dim), dim 2 or 3
    cells: NDArray[np.int64]  #: node indices, shape (cells, nodes per cell)
    cell_type: str  #: triangle, triangle6, quad, quad9, tetra, tetra10, hexahedron, hexahedron27
    surfaces: dict[str, NDArray[np.int64]] = field(
        default_factory=dict
    )  #: name -> corner nodes, shape (facets, corners)
    regions: dict[str, NDArray[np.int64]] = field(default_factory=dict)  #: name -> cell indices
    lines: dict[str, NDArray[np.int64]] = field(
        default_factory=dict
    )  #: in space: name -> nodes of lines, shape (lines, 2 or 3): both ends, then the middle
    nodes: dict[str, NDArray[np.int64]] = field(default_factory=dict)  #: name of points -> their nodes
    unmoved: NDArray[np.float64] | None = None  #: positions [m] before nodes of tied surfaces moved, (n, dim)
    numbers: NDArray[np.int64] | None = None  #: of the cells in the file, from 1 on; None: they are all, in their order
    note: str = ""  #: note to the user on changes when the mesh was read
    cones: bool = False  #: of a closed surface: the cells are no more than signed cones to its facets
