"""Sharp edges within a surface of contact: the normals of their nodes are means of two that have little in common."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solvers.cell_types import CELL_TYPES
from solvers.contact.dual_tree import neighbours
from solvers.mesh import Mesh
from solvers.mesh_topology import cut_out
from solvers.tessellation import unit_normals

#: Angle between neighbouring facets from which on an edge is sharp [degrees]; a ring of five facets has 72.
SHARP = 75.0


def sharpest_edge(mesh: Mesh, names: Sequence[str]) -> float:
    """Largest angle [degrees] by which the normal turns from a facet to its neighbour; 0 for one facet."""
    points, facets, _ = cut_out(mesh, names)
    dim = points.shape[1]
    corners = facets[:, : CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].corners]
    normals = unit_normals(points[corners[:, [0, 1, -1][:dim]]])
    i, j = neighbours(corners, dim).T
    least = np.einsum("ed,ed->e", normals[i], normals[j]).min(initial=1.0)
    return float(np.degrees(np.arccos(np.clip(least, -1.0, 1.0))))
