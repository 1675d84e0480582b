"""The boundary of a mesh as segments or triangles, with marked wet facets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.tessellation import tessellate
from solvers.mesh.topology import boundary_facets


@dataclass(frozen=True)
class Skin:
    """The boundary of a mesh as segments or triangles."""

    points: Array  #: reference positions [m] of its vertices, shape (n, dim)
    facets: NDArray[np.int64]  #: vertices of segments or triangles, shape (m, dim)
    nodes: NDArray[np.int64]  #: numbers of the vertices in the mesh
    wet: NDArray[np.bool_] | None = None  #: wet facets; None: found by `find_wet`
    #: vertices in the middle of second-order facets and their edges, with the corners around, each (k, 1 + corners)
    middles: tuple[Indices, ...] = ()


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
    return Skin(mesh.points[nodes], facets, nodes, wet, middle_vertices(mesh, nodes))


def middle_vertices(mesh: Mesh, nodes: Indices) -> tuple[Indices, ...]:
    """Vertices in the middle of second-order facets and their edges, with the corners around; see `Skin.middles`.

    nodes: of the mesh, by vertex.
    """
    facet = CELL_TYPES[CELL_TYPES[mesh.cell_type].facet]
    vertex = np.full(len(mesh.points), -1)
    vertex[nodes] = np.arange(len(nodes))
    facets = vertex[boundary_facets(mesh)]
    facets = facets[(facets >= 0).all(axis=1)]
    found: dict[int, list[Indices]] = {}
    for local, corners in enumerate(facet.nodes):
        if len(corners) > 1:
            found.setdefault(len(corners), []).append(facets[:, [local, *corners]])
    rows = [np.concatenate(some) for some in found.values()]
    return tuple(some[np.unique(some[:, 0], return_index=True)[1]] for some in rows)
