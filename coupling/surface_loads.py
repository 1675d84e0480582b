"""The load of the flow at the nodes of elastic bodies: traction and wall shear stress, for files and pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from coupling.elastic import Elastic
from solvers.api import Array
from solvers.mesh.tessellation import area_vectors, tangential


def surface_loads(
    elastic: Elastic, force: Mapping[str, Array], x: Mapping[str, Array], facets: Mapping[str, NDArray[np.int64]]
) -> dict[str, Array]:
    """Field -> values [Pa] at owned dofs of the structure, zero off the surface (collective).

    traction: force [N] of the flow at a node by its share of the present surface, such that shares and tractions give
    the force exactly; wall_shear_stress: its tangential part. By surface: force and positions x [m] at vertices, shape
    (n, dim), and their segments or triangles.
    """
    names: Sequence[str] = list(elastic.surfaces)
    area, normal = zip(*(_shares(x[name], facets[name]) for name in names), strict=True)
    at_nodes = [elastic.spread(np.concatenate(values)) for values in ([force[name] for name in names], area, normal)]
    dim = elastic.dofs.shape[1]
    load, share, direction = (values.reshape(-1, dim) for values in at_nodes)
    traction = np.divide(load, share, out=np.zeros_like(load), where=share > 0.0)
    return {"traction": traction.ravel(), "wall_shear_stress": tangential(traction, direction).ravel()}


def _shares(x: Array, facets: NDArray[np.int64]) -> tuple[Array, Array]:
    """Area [m^2] (length in 2D) of each vertex, in all components, and its area vector, both of shape (n, dim)."""
    dim, vectors = x.shape[1], area_vectors(x[facets])
    sizes = np.linalg.norm(vectors, axis=1)
    area, normal = np.zeros_like(x), np.zeros_like(x)
    for corner in facets.T:
        np.add.at(area, corner, sizes[:, None] / dim)
        np.add.at(normal, corner, vectors / dim)
    return area, normal
