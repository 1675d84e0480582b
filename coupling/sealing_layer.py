"""A tight layer on contact surfaces: the fluid ends in front of the solid, so that closed contact has no slits.

Contact conditions hold in the mean over facets. Between curved surfaces, or along two edges, slits of about a
thousandth of a facet remain. Hardly any fluid would pass them, but on a grid of larger cells they connect both sides.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coupling.wetted import WettedSurface
from solvers.api import Array
from solvers.mesh.tessellation import area_vectors

#: Largest displacement of a vertex in thicknesses. At edges below 60 degrees the layer is thinner than elsewhere.
LARGEST_MOVE = 2.0


@dataclass(frozen=True)
class SealingLayer:
    """The layer of one body. It has a constant thickness and moves with its facets."""

    facets: NDArray[np.int64]  #: that it lies on, vertices of segments or triangles, shape (m, dim)
    thickness: float  #: [m]

    def cover(self, x: Array) -> Array:
        """Positions [m] of all vertices on the layer, from those on the solid, shape (n, dim).

        A vertex moves by thickness A S / |S|^2, with the sum S of the area vectors of the facets around it and the
        sum A of their areas. Planes move by the thickness, also those that meet at an edge with equal facets.
        """
        vectors = area_vectors(x[self.facets])
        total, area = np.zeros_like(x), np.zeros(len(x))
        for corner in self.facets.T:
            np.add.at(total, corner, vectors)
            np.add.at(area, corner, np.linalg.norm(vectors, axis=1))
        size = np.linalg.norm(total, axis=1)
        some = size > 0.0
        way = np.zeros_like(x)
        reach = np.minimum(area[some] / size[some], LARGEST_MOVE)
        way[some] = self.thickness * (reach / size[some])[:, None] * total[some]
        return x + way


def sealing_layers(surfaces: Iterable[WettedSurface], thickness: float) -> dict[str, SealingLayer]:
    """Layers [m] on the facets that take part in contact, by the names of surfaces that have any."""
    marked = {s.name: s.facets[s.in_contact] for s in surfaces if s.in_contact is not None}
    return {name: SealingLayer(facets, thickness) for name, facets in marked.items() if len(facets)}
