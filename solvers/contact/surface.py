"""Contact surfaces, and the common numbering of their nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.mesh.cell_types import CELL_TYPES


@dataclass(frozen=True)
class Surface:
    """One side of a contact pair, the same on every process.

    A rigid surface has no dofs. It is at rest or follows `motion`.
    """

    name: str
    points: Array  #: reference positions [m], shape (n, dim)
    facets: NDArray[np.int64]  #: nodes of each facet in VTK order, outward oriented, shape (k, nodes per facet)
    facet_type: str  #: line, line3, triangle, triangle6, quad, quad9
    dofs: NDArray[np.int64] | None  #: global dofs of each node, shape (n, dim); None if rigid
    held: Array | None = None  #: projections on the directions that supports prescribe, shape (n, dim, dim)
    body: str = ""  #: name of its body
    symmetric: NDArray[np.bool_] | None = None  #: held by planes of symmetry: normals have no such component, (n, dim)
    mesh_nodes: NDArray[np.int64] | None = None  #: number of each node in the mesh of the body
    unmoved: Array | None = None  #: positions [m] before nodes of tied surfaces were moved, shape (n, dim)
    motion: Callable[[float], Array] | None = None  #: rigid: positions [m] at a time, shape (n, dim)

    @property
    def corners(self) -> Array:
        """Reference positions [m] of the corners of the facets, shape (k, corners, dim)."""
        return self.points[self.facets[:, : CELL_TYPES[self.facet_type].corners]]


@dataclass(frozen=True)
class ContactNodes:
    """The nodes of all surfaces, each deformable node once."""

    points: Array  #: reference positions [m], shape (N, dim)
    dofs: NDArray[np.int64]  #: global dofs, -1 where rigid, shape (N, dim)
    held: Array  #: projections on what is prescribed (all of a rigid node), shape (N, dim, dim)
    of_surface: tuple[NDArray[np.int64], ...]  #: node numbers of each surface

    @property
    def dim(self) -> int:
        return self.points.shape[1]

    @property
    def fixed(self) -> NDArray[np.bool_]:
        """Mask of the nodes that are held in all directions, shape (N,)."""
        return np.einsum("nii->n", self.held) > self.dim - 0.5


def number_nodes(surfaces: Sequence[Surface]) -> ContactNodes:
    """Number the nodes of the surfaces together: nodes with the same dofs are the same node."""
    points, dofs, held, numbers = [], [], [], []
    number_of: dict[int, int] = {}  #: by the first dof of a node
    count = 0
    for surface in surfaces:
        n, dim = surface.points.shape
        own = np.full((n, dim), -1) if surface.dofs is None else surface.dofs
        whole = np.broadcast_to(np.eye(dim), (n, dim, dim))
        fixed = whole if surface.dofs is None else surface.held
        number = np.empty(n, dtype=np.int64)
        new = []
        for i, first in enumerate(own[:, 0].tolist()):
            if first >= 0 and first in number_of:
                number[i] = number_of[first]
                continue
            number[i] = count
            if first >= 0:
                number_of[first] = count
            new.append(i)
            count += 1
        points.append(surface.points[new])
        dofs.append(own[new])
        held.append(np.zeros((len(new), dim, dim)) if fixed is None else fixed[new])
        numbers.append(number)
    return ContactNodes(np.concatenate(points), np.concatenate(dofs), np.concatenate(held), tuple(numbers))


def facet_areas(points: Array, facets: NDArray[np.int64], facet_type: str) -> Array:
    """Area (2D: length) [m^(dim-1)] of each facet between its corners, shape (k,)."""
    corners = points[facets[:, : CELL_TYPES[facet_type].corners]]
    if corners.shape[1] == 2:
        return np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    diagonals = corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1]
    return 0.5 * np.linalg.norm(np.cross(*diagonals), axis=1)


def nodal_areas(points: Array, facets: NDArray[np.int64], facet_type: str) -> Array:
    """Area [m^(dim-1)] of each node: its equal part of the facets around it, shape (n,)."""
    areas = facet_areas(points, facets, facet_type) / facets.shape[1]
    found = np.zeros(len(points))
    np.add.at(found, facets, areas[:, None])
    return found


def longest_edge(corners: Array) -> float:
    """Longest edge [m] of facets with given corners [m], shape (k, corners, dim)."""
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
