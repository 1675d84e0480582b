"""The load of the flow at the nodes of elastic bodies: traction and wall shear stress, for files and pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from coupling.elastic import Elastic
from solvers.api import Array
from solvers.mesh.tessellation import tangential, vertex_shares

#: Share of a node over that of the vertices around it, below which it has hardly any: it is 4/9 and more at nodes of
#: segments and quadrilaterals; at corners of second-order triangles, which a uniform pressure does not load, it is the
#: square of their angle with their neighbours. Tractions on planes are the same from 1e-3 to 0.3.
LITTLE = 0.1


def surface_loads(
    elastic: Elastic, force: Mapping[str, Array], x: Mapping[str, Array], facets: Mapping[str, NDArray[np.int64]]
) -> dict[str, Array]:
    """Field -> values [Pa] at owned dofs of the structure, zero off the surface (collective).

    traction: force [N] of the flow at a node by its share of the present surface, such that shares and tractions give
    the force exactly; at nodes with hardly any share the mean of the vertices around. wall_shear_stress: its tangential
    part. By surface: force and positions x [m] at vertices, shape (n, dim), and their segments or triangles.
    """
    names: Sequence[str] = list(elastic.surfaces)
    dim = elastic.dofs.shape[1]
    areas, normals = zip(*(vertex_shares(x[name], facets[name]) for name in names), strict=True)
    shares = [np.tile(area[:, None], dim) for area in areas]  # in all components
    at_vertices = [np.concatenate(some) for some in ([force[name] for name in names], shares, normals)]
    exact = [elastic.spread(values).reshape(-1, dim) for values in at_vertices]
    around = [elastic.spread_by_size(values).reshape(-1, dim) for values in at_vertices]
    little = exact[1] < LITTLE * around[1]
    load, share, direction = (np.where(little, mean, own) for mean, own in zip(around, exact, strict=True))
    traction = np.divide(load, share, out=np.zeros_like(load), where=share > 0.0)
    return {"traction": traction.ravel(), "wall_shear_stress": tangential(traction, direction).ravel()}
