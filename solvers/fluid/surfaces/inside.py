"""Tests whether points lie in bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion, together

#: Winding number above which a point is in a body. Near a concave corner outside of it, it may exceed 0.5.
INSIDE = 1.0 - 1e-6


class PointInBody(ValueError):
    """There is no fluid at a probe's point."""


def require_outside(x: Array, surfaces: Sequence[ImmersedSurface], motions: Sequence[Motion]) -> None:
    """Raises PointInBody if the point x [m] is in one of the bodies."""
    facets, motion = together(surfaces, motions, len(x))
    if winding(x, motion, facets) > INSIDE:
        inside = next(s for s, m in zip(surfaces, motions, strict=True) if winding(x, m, s.facets) > INSIDE)
        raise PointInBody(f"there is no fluid at {tuple(x.tolist())}: the point is in body '{inside.name}'")


def winding(x: Array, motion: Motion, facets: NDArray[np.int64]) -> float:
    """Winding number of closed surfaces around a point: 1 in a body, 0 outside, between them on the surface.

    It is the sum of the angles of segments, or of the solid angles of triangles, divided by the full angle. A facet
    whose plane contains the point contributes zero: rounding would decide its sign.
    Source: van Oosterom, Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125-126.
    """
    corners = motion.x[facets] - x
    lengths = np.linalg.norm(corners, axis=2)
    if len(x) == 2:
        a, b = corners[:, 0], corners[:, 1]
        across, along = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1)
    else:
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        la, lb, lc = lengths.T
        across = np.linalg.det(corners)
        along = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
    seen = np.abs(across) > 1e-9 * lengths.prod(axis=1)
    return float(np.arctan2(across[seen], along[seen]).sum() / (2.0 * np.pi))
