"""Tests whether points lie in bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion, together

#: Sine of the angle, or of the solid angle, between a point and the plane of a facet up to which it lies in this plane.
IN_PLANE = 1e-9
#: Winding number above which a point is in a body, in the planes of up to 1,000 facets. Near a concave corner outside
#: of it, it may exceed 0.5.
INSIDE = 1.0 - 1e3 * IN_PLANE
#: Pairs of a point and a facet that are evaluated together: arrays of some 10 MB.
PAIRS_AT_ONCE = 100_000


class PointInBody(ValueError):
    """There is no fluid at a probe's point."""


def require_outside(x: Array, surfaces: Sequence[ImmersedSurface], motions: Sequence[Motion]) -> None:
    """Raises PointInBody if the point x [m] is in one of the bodies."""
    facets, motion = together(surfaces, motions, len(x))
    if winding(x, motion, facets) > INSIDE:
        inside = next(s for s, m in zip(surfaces, motions, strict=True) if winding(x, m, s.facets) > INSIDE)
        raise PointInBody(f"there is no fluid at {tuple(x.tolist())}: the point is in body '{inside.name}'")


def winding(x: Array, motion: Motion, facets: NDArray[np.int64]) -> float:
    """Winding number of closed surfaces around a point, see `windings`."""
    return float(windings(x[None], motion, facets)[0])


def windings(points: Array, motion: Motion, facets: NDArray[np.int64]) -> Array:
    """Winding numbers of closed surfaces around points (n, dim): 1 in a body, 0 outside, between them on the surface.

    They are the sums of the angles of segments, or of the solid angles of triangles, divided by the full angle. A facet
    whose plane contains the point contributes zero: rounding would decide its sign.
    Source: van Oosterom, Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125-126.
    """
    used, numbers = np.unique(facets, return_inverse=True)
    vertices, facets, found = motion.x[used].T, numbers.reshape(facets.shape).T, np.empty(len(points))
    together = max(1, PAIRS_AT_ONCE // max(1, len(facets.T)))
    for first in range(0, len(points), together):
        some = slice(first, first + together)
        found[some] = _angles(vertices[:, None] - points[some].T[:, :, None], facets).sum(axis=1) / (2.0 * np.pi)
    return found


def _angles(way: Array, facets: NDArray[np.int64]) -> Array:
    """Angles of facets seen from points, those of triangles halved, (points, facets).

    way: from each point to each vertex, (dim, points, vertices); facets: (dim, facets).
    """
    length = np.sqrt((way * way).sum(axis=0))
    ends, lengths = [way[:, :, vertex] for vertex in facets], [length[:, vertex] for vertex in facets]
    if len(way) == 2:
        a, b = ends
        across, along = a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]
    else:
        (a, b, c), (la, lb, lc) = ends, lengths
        across = (a * np.cross(b, c, axis=0)).sum(axis=0)
        along = la * lb * lc + (a * b).sum(axis=0) * lc + (b * c).sum(axis=0) * la + (c * a).sum(axis=0) * lb
    seen = np.abs(across) > IN_PLANE * np.prod(lengths, axis=0)
    return np.where(seen, np.arctan2(across, along), 0.0)
