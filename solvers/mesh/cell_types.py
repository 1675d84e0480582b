"""Types of cells and facets: what is special about each is in its record here, the blended basis of contact apart.

Names are those of meshio. Nodes follow VTK's order, second-order nodes included. Facets are oriented outward: in 3D
their nodes run counterclockwise seen from outside; in 2D the body lies on the left of the way from the first node to
the second, so that the outward normal of an edge (dx, dy) is (dy, -dx).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Group = tuple[int, ...]


@dataclass(frozen=True)
class Shape:
    """Properties of cells of one shape that do not depend on their order."""

    name: str  #: in UFL and basix
    corners: tuple[tuple[float, ...], ...]  #: of the unit cell, edges from 0 to 1
    facets: tuple[Group, ...] = ()  #: corners of each facet, outward oriented
    mirror: Group = ()  #: corners of the cell turned inside out
    simplex: bool = False


@dataclass(frozen=True)
class CellType:
    """A type of cells, or of facets."""

    name: str
    shape: Shape
    first_order: str  #: type of the cell of its corners
    nodes: tuple[Group, ...]  #: every node as the corners whose middle it is: (2,) a corner, (0, 1) a mid node
    facet: str = ""  #: type of its facets, of cells of a mesh
    quadrature: tuple[int, int] = (0, 0)  #: degrees of full integration of the affine cell: of inner forces, of mass
    kernel: str = ""  #: of facets: their name in the kernels
    simplices: tuple[Group, ...] = ()  #: of facets: segments or triangles through all nodes, oriented like the facet

    @property
    def corners(self) -> int:
        """Number of corners."""
        return len(self.shape.corners)

    @property
    def degree(self) -> int:
        """Degree of its shape functions."""
        return 1 if self.name == self.first_order else 2

    @cached_property
    def reference_nodes(self) -> NDArray[np.float64]:
        """Positions of the nodes in the unit cell, shape (nodes, dim)."""
        corners = np.array(self.shape.corners, dtype=float)
        return np.array([corners[list(group)].mean(axis=0) for group in self.nodes])

    @cached_property
    def middle(self) -> NDArray[np.float64]:
        """The middle of the unit cell, shape (dim,)."""
        return np.asarray(self.reference_nodes[: self.corners].mean(axis=0))

    @cached_property
    def facets(self) -> tuple[Group, ...]:
        """Local nodes of every facet, outward oriented, in the order of the facet's type."""
        return tuple(self._nodes_of(CELL_TYPES[self.facet], facet) for facet in self.shape.facets)

    @cached_property
    def mirror(self) -> Group:
        """Local nodes of the cell turned inside out: makes a cell of negative volume positive."""
        return self._nodes_of(self, self.shape.mirror)

    def _nodes_of(self, part: CellType, corners: Group) -> Group:
        """Local nodes of that part (facet, mirrored cell) which has these corners."""
        position = {frozenset(group): node for node, group in enumerate(self.nodes)}
        return tuple(position[frozenset(corners[i] for i in group)] for group in part.nodes)


def _corners(count: int) -> tuple[Group, ...]:
    return tuple((corner,) for corner in range(count))


_SQUARE = ((0, 0), (1, 0), (1, 1), (0, 1))

_LINE = Shape("interval", ((0,), (1,)), simplex=True)
_TRIANGLE = Shape("triangle", ((0, 0), (1, 0), (0, 1)), ((0, 1), (1, 2), (2, 0)), (0, 2, 1), simplex=True)
_QUAD = Shape("quadrilateral", _SQUARE, ((0, 1), (1, 2), (2, 3), (3, 0)), (0, 3, 2, 1))
_TETRA = Shape(
    "tetrahedron",
    ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    (0, 2, 1, 3),
    simplex=True,
)
_HEXAHEDRON = Shape(
    "hexahedron",
    tuple((x, y, z) for z in (0, 1) for x, y in _SQUARE),
    ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    (0, 3, 2, 1, 4, 7, 6, 5),
)

#: By name. The triangles of a second-order quadrilateral meet in its middle node, so that no diagonal is preferred.
CELL_TYPES = {
    cell_type.name: cell_type
    for cell_type in (
        CellType("line", _LINE, "line", _corners(2), kernel="line2", simplices=((0, 1),)),
        CellType("line3", _LINE, "line", (*_corners(2), (0, 1)), kernel="line3", simplices=((0, 2), (2, 1))),
        CellType("triangle", _TRIANGLE, "triangle", _corners(3), "line", (1, 2), "tri3", ((0, 1, 2),)),
        CellType(
            "triangle6",
            _TRIANGLE,
            "triangle",
            (*_corners(3), (0, 1), (1, 2), (2, 0)),
            "line3",
            (2, 4),
            "tri6",
            ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
        ),
        CellType("quad", _QUAD, "quad", _corners(4), "line", (3, 3), "quad4", ((0, 1, 2), (0, 2, 3))),
        CellType(
            "quad9",
            _QUAD,
            "quad",
            (*_corners(4), (0, 1), (1, 2), (2, 3), (3, 0), (0, 1, 2, 3)),
            "line3",
            (5, 5),
            "quad9",
            ((0, 4, 8), (4, 1, 8), (1, 5, 8), (5, 2, 8), (2, 6, 8), (6, 3, 8), (3, 7, 8), (7, 0, 8)),
        ),
        CellType("tetra", _TETRA, "tetra", _corners(4), "triangle", (1, 2)),
        CellType(
            "tetra10",
            _TETRA,
            "tetra",
            (*_corners(4), (0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
            "triangle6",
            (2, 4),
        ),
        CellType("hexahedron", _HEXAHEDRON, "hexahedron", _corners(8), "quad", (3, 3)),
        CellType(
            "hexahedron27",
            _HEXAHEDRON,
            "hexahedron",
            (
                *_corners(8),
                *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
                *((0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)),
                (0, 1, 2, 3, 4, 5, 6, 7),
            ),
            "quad9",
            (5, 5),
        ),
    )
}


def reference_nodes(cell_type: str) -> NDArray[np.float64]:
    """Positions of the nodes in the unit cell (edges from 0 to 1), shape (nodes, dim)."""
    return CELL_TYPES[cell_type].reference_nodes
