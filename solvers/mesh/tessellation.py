"""Surfaces of meshes as linear simplices: the surface of a solid in a fluid, whatever cells the solid has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Indices
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_facets, surface_facets

Array = NDArray[np.float64]

#: Angle [rad] between neighbouring facets from which their edge is sharp: one of the body, not of its approximation.
#: From 30 to 85 degrees results are the same.
SHARP = np.pi / 3


def tessellate(mesh: Mesh, names: Sequence[str] | None = None) -> tuple[Indices, Indices]:
    """(simplices of shape (m, dim), nodes of shape (n,)) of named surfaces, by default of the whole boundary.

    Simplices index `nodes`, which are numbers of mesh nodes, each once and increasing. Their right-hand normals point
    out of the mesh: in 2D segments run with the body on their left. Raises KeyError and ValueError as `surface_facets`.
    """
    parts = [boundary_facets(mesh)] if names is None else [surface_facets(mesh, name) for name in names]
    facets = np.concatenate(parts)
    split = np.array(CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].simplices)
    simplices = facets[:, split].reshape(-1, split.shape[1])
    nodes, local = np.unique(simplices, return_inverse=True)
    return local.reshape(simplices.shape).astype(np.int64), nodes.astype(np.int64)


def area_vectors(corners: Array) -> Array:
    """Normal times length of segments [m] or area of triangles [m^2], shape (..., dim, dim) -> (..., dim).

    It points to the right of a segment, and to where a triangle is seen to run counterclockwise.
    """
    edges = corners[..., 1:, :] - corners[..., :1, :]
    if corners.shape[-1] == 2:
        return np.stack([edges[..., 0, 1], -edges[..., 0, 0]], axis=-1)
    return 0.5 * np.cross(edges[..., 0, :], edges[..., 1, :])


def unit_normals(corners: Array) -> Array:
    """Unit normals of segments or triangles, shape (..., dim, dim) -> (..., dim); zero where there is no extent."""
    along = area_vectors(corners)
    size = np.linalg.norm(along, axis=-1, keepdims=True)
    return np.divide(along, size, out=np.zeros_like(along), where=size > 0.0)


def is_closed(simplices: Indices) -> bool:
    """Whether simplices form a closed surface: each end or edge has as many simplices of either orientation."""
    if simplices.shape[1] == 2:
        count = int(simplices.max(initial=-1)) + 1
        ends = np.bincount(simplices[:, 1], minlength=count) - np.bincount(simplices[:, 0], minlength=count)
        return not ends.any()
    edges = np.concatenate([simplices[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    forward, first = np.sort(edges, axis=1), np.where(edges[:, 0] < edges[:, 1], 1, -1)
    _, number = np.unique(forward, axis=0, return_inverse=True)
    return not np.bincount(number.ravel(), weights=first).any()


def tangential(vectors: Array, normals: Array) -> Array:
    """The part of each vector along the surface, shape (n, dim); normals may have any length but zero, and any sign."""
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = np.divide(normals, size, out=np.zeros_like(normals), where=size > 0.0)
    return vectors - np.einsum("nd,nd->n", vectors, unit)[:, None] * unit


def vertex_shares(x: Array, facets: Indices) -> tuple[Array, Array]:
    """(area [m^2] (length in 2D), shape (n,); area vector, shape (n, dim)) of vertices: int N_b ds, int N_b n ds.

    facets: segments or triangles with their corners at x [m], shape (n, dim).
    """
    dim, vectors = x.shape[1], area_vectors(x[facets])
    parts = np.column_stack([np.linalg.norm(vectors, axis=1), vectors]).repeat(dim, axis=0) / dim
    area, *normal = (np.bincount(facets.ravel(), weights=part, minlength=len(x)) for part in parts.T)
    return np.asarray(area), np.stack(normal, axis=1)
