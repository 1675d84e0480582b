"""Where the facets of a mesh stand for a curved surface, and where they meet in an edge."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.contact.sharp_edges import split_nodes
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.tessellation import area_vectors, tessellate, unit_normals

#: Below this angle two facets are one plane, up to the seven digits of files.
FLAT = np.radians(0.1)
#: From this angle on they meet in an edge: a circle has more than six facets.
EDGE = np.radians(60.0)


def is_curved(mesh: Mesh, names: Sequence[str] | None = None) -> bool:
    """Whether a plane part of named surfaces, by default of all, is bent on two sides, as a facet of a circle is."""
    simplices, nodes = tessellate(mesh, names)
    normals = unit_normals(mesh.points[nodes][simplices])
    first, second = _neighbours(simplices)
    cosines = (normals[first] * normals[second]).sum(axis=1)
    flat = cosines >= np.cos(FLAT)
    bent = (cosines > np.cos(EDGE) + 1e-9) & ~flat
    planes = _joined(len(simplices), first[flat], second[flat])
    sides = np.sort(np.stack([planes[first[bent]], planes[second[bent]]], axis=1), axis=1)
    sides = np.unique(sides[sides[:, 0] != sides[:, 1]], axis=0)
    return bool((np.bincount(sides.ravel(), minlength=1) > 1).any())


def facet_height(mesh: Mesh, names: Sequence[str] | None = None) -> float:
    """Largest height [m] of the smooth surface over straight facets of named surfaces, by default of all.

    By the normals n at its ends the arc over an edge e has the height (n_2 - n_1) . e / 8; in 3D that of a facet is at
    most the sum over its edges. Second-order cells have none.
    """
    if mesh.cells.size and CELL_TYPES[mesh.cell_type].degree > 1:
        return 0.0
    simplices, nodes = tessellate(mesh, names)
    x = mesh.points[nodes]
    sides = split_nodes(x, simplices, "line" if x.shape[1] == 2 else "triangle")
    corners, areas = x[simplices], area_vectors(x[simplices])
    sums = np.zeros((len(sides.nodes), x.shape[1]))
    np.add.at(sums, sides.facets, areas[:, None])
    normals = (sums / np.linalg.norm(sums, axis=1, keepdims=True))[sides.facets]
    height = np.zeros(len(simplices))
    for first, second in [(0, 1)] if x.shape[1] == 2 else [(0, 1), (1, 2), (2, 0)]:
        turned, edge = normals[:, second] - normals[:, first], corners[:, second] - corners[:, first]
        height += np.abs(np.einsum("md,md->m", turned, edge)) / 8.0
    return float(height.max())


def outward_edges(mesh: Mesh, names: Sequence[str] | None = None) -> NDArray[np.float64]:
    """Centres [m] of edges, in 2D of corners, that stick out of the body, shape (n, dim), of named surfaces or all.

    Around them is more than a half space of fluid, at most 360 degrees less the 120 of a hexagon.
    """
    simplices, nodes = tessellate(mesh, names)
    corners = mesh.points[nodes][simplices]
    normals, centres = unit_normals(corners), corners.mean(axis=1)
    first, second = _neighbours(simplices)
    sharp = (normals[first] * normals[second]).sum(axis=1) <= np.cos(EDGE) + 1e-9
    outward = ((centres[second] - centres[first]) * normals[first]).sum(axis=1) < 0.0
    pairs = np.stack([first, second], axis=1)[sharp & outward]
    found = [corners[a][np.isin(simplices[a], simplices[b])].mean(axis=0) for a, b in pairs]
    return np.array(found).reshape(-1, mesh.points.shape[1])


def _neighbours(simplices: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of simplices with a common end, in 3D a common edge."""
    count = simplices.shape[1]
    rims = np.sort(np.concatenate([np.delete(simplices, corner, axis=1) for corner in range(count)]), axis=1)
    of = np.tile(np.arange(len(simplices)), count)
    order = np.lexsort(rims.T)
    same = (rims[order][1:] == rims[order][:-1]).all(axis=1)
    return of[order[:-1][same]], of[order[1:][same]]


def _joined(count: int, first: NDArray[np.int64], second: NDArray[np.int64]) -> NDArray[np.int64]:
    """A number for each simplex, equal for those that pairs join."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    return np.asarray(connected_components(pairs, directed=False)[1])
