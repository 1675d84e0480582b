"""Tests whether points lie in bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion, together

#: Winding number above which a point is in a body. Near a concave corner outside of it, it may exceed 0.5.
INSIDE = 1.0 - 1e-6
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
    corners, found = motion.x[facets], np.empty(len(points))
    together = max(1, PAIRS_AT_ONCE // max(1, len(facets)))
    for first in range(0, len(points), together):
        some = slice(first, first + together)
        found[some] = _angles(corners - points[some, None, None]).sum(axis=1) / (2.0 * np.pi)
    return found


def _angles(corners: Array) -> Array:
    """Angles at the origin, those of triangles halved; corners: (..., corner, dim)."""
    lengths = np.linalg.norm(corners, axis=-1)
    if corners.shape[-1] == 2:
        a, b = corners[..., 0, :], corners[..., 1, :]
        across, along = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(axis=-1)
    else:
        a, b, c = (corners[..., k, :] for k in range(3))
        la, lb, lc = (lengths[..., k] for k in range(3))
        across = np.linalg.det(corners)
        along = la * lb * lc + (a * b).sum(axis=-1) * lc + (b * c).sum(axis=-1) * la + (c * a).sum(axis=-1) * lb
    seen = np.abs(across) > 1e-9 * lengths.prod(axis=-1)
    return np.where(seen, np.arctan2(across, along), 0.0)
