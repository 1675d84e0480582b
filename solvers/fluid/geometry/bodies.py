"""The bodies that closed surfaces bound, as `cut_cells` needs them."""

from __future__ import annotations

import numpy as np

from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices, Mask
from solvers.cut_cells import ClosedSurfaces
from solvers.mesh.penetration import windings


def bodies_of(facets: Indices, x: Array) -> Indices:
    """Body of each facet, from 0 on: connected surfaces, a cavity with the surface around it.

    facets: segments or triangles, shape (m, dim), with vertices at x [m].
    """
    body, volume = _connected(facets, x)
    if len(volume) < 2:
        return body
    corners = x[facets]
    body_of = np.arange(len(volume))
    for cavity in np.flatnonzero(volume < 0.0).tolist():
        point = corners[np.flatnonzero(body == cavity)[:1], 0]
        outer = [k for k in np.flatnonzero(volume > 0.0).tolist() if windings(point, corners[body == k])[0] > 0.5]
        if outer:
            body_of[cavity] = min(outer, key=lambda k: volume[k])
    return np.unique(body_of, return_inverse=True)[1][body]


def in_cavities(facets: Indices, x: Array) -> Mask:
    """Mask of the facets of surfaces whose normals point inwards. facets, x: as for `bodies_of`."""
    part, volume = _connected(facets, x)
    return np.asarray((volume < 0.0)[part])


def _connected(facets: Indices, x: Array) -> tuple[Indices, Array]:
    """Number of the connected surface of each facet, and what each encloses, times dim! [m^dim]."""
    edges = np.concatenate([facets[:, k : k + 2] for k in range(facets.shape[1] - 1)])
    part = connected_parts(edges[:, 0], edges[:, 1], len(x))[facets[:, 0]]
    parts, number = np.unique(part, return_inverse=True)
    corners = x[facets]
    volumes = np.linalg.det(corners - corners.mean(axis=(0, 1)))
    return number, np.asarray(np.bincount(number, volumes, len(parts)), dtype=float)


def closed_surfaces(facets: Indices, x: Array) -> ClosedSurfaces | None:
    """Surfaces of bodies; None if one is open: facets that are divided at a tie have vertices in edges of others.

    facets, x: as for `bodies_of`.
    """
    try:
        return ClosedSurfaces(facets, bodies_of(facets, x))
    except ValueError:
        return None
