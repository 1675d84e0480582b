"""Mass, centre and moments of inertia of a rigid body; in 2D per depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array


@dataclass(frozen=True)
class Inertia:
    """Mass properties of a body at the start."""

    mass: float  #: [kg]
    centre: Array  #: centre of mass [m], shape (dim,)
    tensor: Array  #: moments of inertia about the centre [kg m^2], shape (3, 3); in 2D only the last entry is used


def inertia_of_surface(points: Array, facets: NDArray[np.int64], density: float) -> Inertia:
    """Inertia of a homogeneous body with a closed surface.

    points: vertices [m], (n, dim); facets: segments or triangles, (m, dim); density [kg/m^3].
    It is a sum over signed simplices with corners a_i, from the mean vertex to the facets, and exact for polyhedra:
    int x x^T = V / ((d + 1) (d + 2)) (sum_i a_i a_i^T + s s^T), s = sum_i a_i.
    """
    dim, origin = points.shape[1], points.mean(axis=0)
    corners = points[facets] - origin
    volumes = np.linalg.det(corners) / (2.0 if dim == 2 else 6.0)
    sums = corners.sum(axis=1)
    volume = float(volumes.sum())
    centre = volumes @ sums / ((dim + 1) * volume)
    second = np.einsum("m,mai,maj->ij", volumes, corners, corners) + np.einsum("m,mi,mj->ij", volumes, sums, sums)
    spread = np.zeros((3, 3))
    spread[:dim, :dim] = density * (second / ((dim + 1) * (dim + 2)) - volume * np.outer(centre, centre))
    return Inertia(density * volume, origin + centre, np.trace(spread) * np.eye(3) - spread)
