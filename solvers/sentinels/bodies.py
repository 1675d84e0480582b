"""Bodies as sentinels see them: closed surfaces that move, with the size and the bend of their facets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices
from solvers.mesh.tessellation import SHARP, area_vectors, unit_normals
from solvers.mesh.wall_thickness import wall_thickness

#: Facets whose walls are measured for a median.
SAMPLE = 50

#: Distance, relative to the thickness, that Newton's tolerance and rounding leave between surfaces that touch.
LEFT_BETWEEN = 1e-6


@dataclass(frozen=True)
class MovingBody:
    """The whole surface of one body."""

    name: str
    facets: Indices  #: vertices of segments or triangles, (m, dim), with the solid on their left or behind them
    positions: Callable[[float], Array]  #: time [s] -> positions of the vertices [m], (n, dim), on all processes
    free: bool  #: elastic, or a rigid body that the flow moves; else rigid and at rest or driven
    pieces: int = 1  #: edges of facets here in one edge of a facet of its mesh: 2 with middle nodes
    rigid: bool = False
    dry: NDArray[np.bool_] | None = None  #: vertices without fluid, (n,), which walls of the fluid's box do not hold


class Measures:
    """Sizes of a body at the start, from the corners of its facets, shape (m, dim, dim) [m]."""

    def __init__(self, facets: Indices, corners: Array):
        self._facets, self._corners = facets, corners
        edges = np.roll(corners, -1, axis=1) - corners
        self.edge: Array = np.linalg.norm(edges, axis=2).max(axis=1)  #: longest edge of each facet [m]

    @cached_property
    def thickness(self) -> float:
        """Two times volume over area [m]: the thickness of a plate, the radius of a disc."""
        areas = area_vectors(self._corners)
        dim = areas.shape[1]
        middles = self._corners.mean(axis=1) - self._corners.mean(axis=(0, 1))
        volume = abs(float(np.einsum("md,md->", middles, areas))) / dim
        return 2.0 * volume / float(np.linalg.norm(areas, axis=1).sum())

    def thickness_at(self, facets: Indices) -> float:
        """Median thickness [m] of the walls behind some facets (a sample of them), at most that of the body.

        At least half of a facet's edge: walls that end in a wedge have no thickness there.
        """
        sample = facets[:: max(1, len(facets) // SAMPLE)]
        walls = wall_thickness(self._corners.mean(axis=1), unit_normals(self._corners), sample)
        return min(self.thickness, max(float(np.median(walls)), 0.5 * float(np.median(self.edge[facets]))))

    @cached_property
    def bends(self) -> tuple[Array, Array]:
        """Largest angle [rad] to a neighbour by facet, (m,): over smooth edges, over sharp ones (0 without)."""
        normals = unit_normals(self._corners)
        facets, dim = self._facets, self._facets.shape[1]
        edges = facets.T.reshape(-1, 1) if dim == 2 else np.concatenate([facets[:, [k, (k + 1) % 3]] for k in range(3)])
        owner, edges = np.tile(np.arange(len(facets)), dim), np.sort(edges, axis=1)
        order = np.lexsort(edges.T)
        same = (edges[order][1:] == edges[order][:-1]).all(axis=1)
        i, j = owner[order][:-1][same], owner[order][1:][same]
        angle = np.arccos(np.clip(np.einsum("ed,ed->e", normals[i], normals[j]), -1.0, 1.0))
        smooth, sharp = np.zeros(len(facets)), np.zeros(len(facets))
        for target, kept in ((smooth, angle < SHARP), (sharp, angle >= SHARP)):
            np.maximum.at(target, i[kept], angle[kept])
            np.maximum.at(target, j[kept], angle[kept])
        return smooth, sharp

    @cached_property
    def curvature(self) -> Array:
        """Angle of smooth edges over the length of a facet [1/m], (m,)."""
        return self.bends[0] / self.edge

    @cached_property
    def sagitta(self) -> Array:
        """Height [m] of the arcs that the facets replace, (m,)."""
        return arc_height(self.edge, self.bends[0])


def arc_height(chord: Array, angle: Array) -> Array:
    """Height c/2 tan(angle/4) [m] of an arc with a chord c [m] over which the tangent turns by an angle [rad]."""
    return 0.5 * chord * np.tan(np.minimum(angle, np.pi) / 4.0)
