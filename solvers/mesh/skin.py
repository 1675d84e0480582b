"""The boundary of a mesh as segments or triangles, with marked wet facets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.mesh.mesh import Mesh
from solvers.mesh.tessellation import tessellate


@dataclass(frozen=True)
class Skin:
    """The boundary of a mesh as segments or triangles."""

    points: Array  #: reference positions [m] of its vertices, shape (n, dim)
    facets: NDArray[np.int64]  #: vertices of segments or triangles, shape (m, dim)
    nodes: NDArray[np.int64]  #: numbers of the vertices in the mesh
    wet: NDArray[np.bool_] | None = None  #: wet facets; None: found by `find_wet`


def cut_out_skin(mesh: Mesh, names: Sequence[str] | None = None) -> Skin:
    """The whole boundary of a mesh; with names only these surfaces are wet.

    Raises KeyError for surfaces that do not exist, ValueError for those that are not on the boundary.
    """
    facets, nodes = tessellate(mesh)
    wet = None
    if names is not None:
        some, some_nodes = tessellate(mesh, names)
        chosen = {tuple(facet) for facet in np.sort(some_nodes[some], axis=1).tolist()}
        wet = np.array([tuple(facet) in chosen for facet in np.sort(nodes[facets], axis=1).tolist()])
    return Skin(mesh.points[nodes], facets, nodes, wet)
