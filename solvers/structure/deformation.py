"""Checks of deformations: unbounded displacements and inverted elements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI

from solvers.api import Array
from solvers.structure.body import Body

#: Displacement, relative to the size of the largest body, above which the system was singular.
FLOWN_OFF = 1e6


def largest_extent(comm: MPI.Comm, bodies: Sequence[Body]) -> float:
    """Size [m] of the largest body (collective)."""
    sizes = (np.ptp(body.points, axis=1).max() for body in bodies if body.points.size)
    return comm.allreduce(max(sizes, default=0.0), op=MPI.MAX)


def flown_off(comm: MPI.Comm, u: Array, extent: float) -> str | None:
    """A reason to reject displacements u [m], None if there is none; extent: size of the bodies [m] (collective)."""
    farthest = comm.allreduce(float(np.abs(u).max(initial=0.0)), op=MPI.MAX)
    if farthest > FLOWN_OFF * extent:
        return f"a displacement of {farthest:.3g} is far larger than the body, {extent:.3g}: is a body not supported?"
    return None


def inverted(bodies: Sequence[Body]) -> tuple[str, tuple[float, ...]] | None:
    """(reason, reference position [m]) if an element is inverted, else None (collective)."""
    volume_ratio, name, place = min((body.smallest_jacobian() for body in bodies), key=lambda jacobian: jacobian[0])
    if volume_ratio > 0.0:
        return None
    return f"element of body '{name}' inverted (volume ratio {volume_ratio:.3g})", place
