"""Bodies in the flow: closed surfaces that rest, follow a given motion, or are moved by another field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion


@dataclass(frozen=True)
class ImmersedBody:
    """A surface in the flow; motion: time [s] -> motion of its vertices; None if another field moves it."""

    surface: ImmersedSurface
    motion: Callable[[float], Motion] | None
    rests: bool = False  #: it never moves
    deforms: bool = False  #: its volume may change
    #: the flux through its surface is the volume that it sweeps; False: that of its velocity, which may be another one
    #: than that of its positions
    sweeps: bool = False
    start: Array | None = None  #: positions of its vertices [m] at the start, if another field moves it

    @property
    def at_start(self) -> Array | None:
        """Positions of its vertices [m] at the time 0, or where another field starts to move it; None if unknown."""
        return self.start if self.motion is None else self.motion(0.0).x


def rigid_body(
    name: str,
    points: Array,
    facets: NDArray[np.int64],
    motion: Callable[[float], tuple[Array, Array]] | None = None,
) -> ImmersedBody:
    """A body with a prescribed motion.

    points: vertices [m], shape (n, dim). facets: segments (2D) or triangles (3D) as vertex numbers, shape (m, dim);
    their right-hand normals point out of the body: in 2D they run with the body on their left.
    motion: t [s] -> (positions [m], velocities [m/s]) of the vertices, each of shape (n, dim); None: it rests. Where it
    moves, the flux through its surface is the volume that it sweeps. Where it does not, a velocity is one in itself.
    """
    points = np.ascontiguousarray(points, dtype=float)
    surface = ImmersedSurface(name, np.asarray(facets, dtype=np.int64), len(points))
    if motion is None:
        return ImmersedBody(surface, lambda t: Motion(points, np.zeros_like(points)), rests=True)
    given = motion
    return ImmersedBody(surface, lambda t: Motion(*given(t)), sweeps=True)
