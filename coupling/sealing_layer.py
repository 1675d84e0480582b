"""A tight layer on contact surfaces: fluid ends this far in front of the solid, so that closed contact has no slits.

Contact holds in the mean over facets. Between two curved surfaces, or along two edges, slits remain that are a thousandth of
a facet high. In a flow of the size of the surfaces nothing passes them, but on a grid they join the fluid of both
sides. Real seals have a soft or rough skin there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.tessellation import area_vectors

#: Vertices of edges sharper than 60 degrees move by twice the thickness; the layer is thinner than it should be there.
FARTHEST = 2.0


@dataclass(frozen=True)
class SealingLayer:
    """The layer of one body, of constant thickness, which moves with its facets."""

    facets: NDArray[np.int64]  #: that it lies on, vertices of segments or triangles, shape (m, dim)
    thickness: float  #: [m]

    def cover(self, x: Array) -> Array:
        """Positions [m] of all vertices on the layer, from those on the solid, shape (n, dim).

        With the area vectors a_f n_f of the facets around a vertex, S their sum and A = sum a_f, it moves by
        thickness A S / |S|^2: by the thickness in front of a plane, and of both planes of an edge.
        """
        vectors = area_vectors(x[self.facets])
        total, area = np.zeros_like(x), np.zeros(len(x))
        for corner in self.facets.T:
            np.add.at(total, corner, vectors)
            np.add.at(area, corner, np.linalg.norm(vectors, axis=1))
        size = np.linalg.norm(total, axis=1)
        some = size > 0.0
        way = np.zeros_like(x)
        reach = np.minimum(area[some] / size[some], FARTHEST)
        way[some] = self.thickness * (reach / size[some])[:, None] * total[some]
        return x + way
