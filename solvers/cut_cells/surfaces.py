"""Closed surfaces of bodies: which facets there are, and that they are closed, checked once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.api import Indices


@dataclass(frozen=True)
class ClosedSurfaces:
    """Facets of bodies, segments (2D) or triangles (3D), with normals out of the solid.

    Segments run counterclockwise round the solid, triangles as seen from outside. Each vertex (2D) or edge (3D) belongs
    to as many facets of its body in one direction as in the other. ValueError for what does not fit or is not closed.
    """

    facets: Indices  #: vertices of each facet, shape (m, dim)
    body: Indices  #: of each facet, numbers from 0, shape (m,)

    def __post_init__(self) -> None:
        facets, body = self.facets, self.body
        if facets.ndim != 2 or facets.shape[1] not in (2, 3):
            raise ValueError(f"facets must have the shape (m, 2) or (m, 3), not {facets.shape}")
        if body.shape != facets.shape[:1]:
            raise ValueError(f"body must have the shape {facets.shape[:1]}, not {body.shape}")
        if len(facets) and (facets.min() < 0 or body.min() < 0):
            raise ValueError("numbers of vertices and bodies must not be negative")
        if (facets == np.roll(facets, 1, axis=1)).any():
            raise ValueError(f"facet {np.flatnonzero((facets == np.roll(facets, 1, axis=1)).any(axis=1))[0]} has a "
                             "vertex twice")  # fmt: skip
        open_bodies = body[self._open()]
        if len(open_bodies):
            raise ValueError(f"the surface of body {open_bodies.min()} is not closed")

    @property
    def dim(self) -> int:
        return int(self.facets.shape[1])

    def _open(self) -> Indices:
        """Facets at a vertex or edge where their body's surface is open."""
        facets, count = self.facets, len(self.facets)
        if self.dim == 2:
            key, sign, of = facets.T.ravel(), np.repeat([-1, 1], count), np.tile(np.arange(count), 2)
        else:
            a, b = facets.ravel(), np.roll(facets, -1, axis=1).ravel()
            key, sign = np.minimum(a, b) * (facets.max(initial=0) + 1) + np.maximum(a, b), np.where(a < b, 1, -1)
            of = np.repeat(np.arange(count), 3)
        order = np.lexsort((key, self.body[of]))
        key, bodies = key[order], self.body[of][order]
        first = np.flatnonzero(np.append(True, (key[1:] != key[:-1]) | (bodies[1:] != bodies[:-1])))
        if not count:
            return np.zeros(0, dtype=np.int64)
        return np.asarray(of[order][first[np.add.reduceat(sign[order], first) != 0]])
