"""Tests whether points lie in bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion, together
from solvers.kernels import seen_angles

#: Sine of the angle, or of the solid angle, between a point and the plane of a facet up to which it lies in this plane.
IN_PLANE = 1e-9
#: Winding number above which a point is in a body, in the planes of up to 1,000 facets. Near a concave corner outside
#: of it, it may exceed 0.5.
INSIDE = 1.0 - 1e3 * IN_PLANE


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
    found = seen_angles(
        np.ascontiguousarray(points, dtype=float),
        np.ascontiguousarray(motion.x[used]),
        np.ascontiguousarray(numbers.reshape(facets.shape), dtype=np.int64),
        IN_PLANE,
    )
    return np.asarray(found) / (2.0 * np.pi)
