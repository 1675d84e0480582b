"""Surfaces of meshes as linear simplices: what a fluid sees of a solid, whatever cells the solid has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.mesh import Mesh
from solvers.mesh_topology import FACET_TYPE, boundary_facets, surface_facets

Indices = NDArray[np.int64]

#: Facet type -> its segments or triangles, oriented like the facet, through all of its nodes. Triangles of a
#: second-order quad meet in its middle node, so that no diagonal is preferred.
SIMPLICES: dict[str, tuple[tuple[int, ...], ...]] = {
    "line": ((0, 1),),
    "line3": ((0, 2), (2, 1)),
    "triangle": ((0, 1, 2),),
    "triangle6": ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    "quad": ((0, 1, 2), (0, 2, 3)),
    "quad9": ((0, 4, 8), (4, 1, 8), (1, 5, 8), (5, 2, 8), (2, 6, 8), (6, 3, 8), (3, 7, 8), (7, 0, 8)),
}


def tessellate(mesh: Mesh, names: Sequence[str] | None = None) -> tuple[Indices, Indices]:
    """(simplices of shape (m, dim), nodes of shape (n,)) of named surfaces, by default of the whole boundary.

    Simplices index `nodes`, which are numbers of mesh nodes, each once and increasing. Their right-hand normals point
    out of the mesh: in 2D segments run with the body on their left. Raises KeyError and ValueError as `surface_facets`.
    """
    parts = [boundary_facets(mesh)] if names is None else [surface_facets(mesh, name) for name in names]
    facets = np.concatenate(parts)
    split = np.array(SIMPLICES[FACET_TYPE[mesh.cell_type]])
    simplices = facets[:, split].reshape(-1, split.shape[1])
    nodes, local = np.unique(simplices, return_inverse=True)
    return local.reshape(simplices.shape).astype(np.int64), nodes.astype(np.int64)


def is_closed(simplices: Indices) -> bool:
    """Whether they enclose something: every end or edge belongs to as many simplices one way as the other."""
    if simplices.shape[1] == 2:
        count = int(simplices.max(initial=-1)) + 1
        ends = np.bincount(simplices[:, 1], minlength=count) - np.bincount(simplices[:, 0], minlength=count)
        return not ends.any()
    edges = np.concatenate([simplices[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    forward, first = np.sort(edges, axis=1), np.where(edges[:, 0] < edges[:, 1], 1, -1)
    _, number = np.unique(forward, axis=0, return_inverse=True)
    return not np.bincount(number.ravel(), weights=first).any()
