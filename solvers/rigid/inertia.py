"""Mass, centre and moments of inertia of a rigid body; in 2D per depth."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array


@dataclass(frozen=True)
class Inertia:
    """Mass properties of a body at the start, about its centre of mass or another point that does not move."""

    mass: float  #: [kg]
    centre: Array  #: the centre of mass or the other point [m], shape (dim,)
    tensor: Array  #: moments of inertia about it [kg m^2], shape (3, 3); in 2D only the last entry is used
    offset: Array = field(default_factory=lambda: np.zeros(3))  #: from it to the centre of mass [m], shape (3,)
    heavy: float | None = None  #: mass that gravity acts on [kg]; None: the same

    @property
    def gravitational_mass(self) -> float:
        return self.mass if self.heavy is None else self.heavy


def about(inertia: Inertia, point: Array) -> Inertia:
    """Inertia about a point [m], shape (dim,), from that about the centre of mass: J + m (r . r 1 - r r^T)."""
    r = np.pad(inertia.centre - point, (0, 3 - len(point)))
    tensor = inertia.tensor + inertia.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return replace(inertia, centre=point, tensor=tensor, offset=r)


def without_inertia(inertia: Inertia) -> Inertia:
    """Of a body in statics: it has weight, but nothing resists its acceleration."""
    return replace(inertia, mass=0.0, tensor=np.zeros((3, 3)), heavy=inertia.gravitational_mass)


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
