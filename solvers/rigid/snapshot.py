"""Snapshots of rigid bodies for files and pictures, without a flow: their surfaces where they are."""

from __future__ import annotations

import numpy as np

from solvers.api import Array, Snapshot
from solvers.rigid.body import in_space
from solvers.rigid.field import RigidBodies
from solvers.rigid.motion import spin
from solvers.rigid.surface import displacements, positions


def snapshots(bodies: RigidBodies) -> list[Snapshot]:
    """One snapshot per body with displacement [m] and velocity [m/s] on rank 0, an empty list on others."""
    if bodies.comm.rank:
        return []
    found, kind = [], "line" if bodies.dim == 2 else "triangle"
    for body, now in zip(bodies.bodies, bodies.now, strict=True):
        u: Array = in_space(displacements([body], [now]))
        velocity = in_space((now.v[:3] + np.cross(spin(now), body.arms(now.R, body.points)))[:, : bodies.dim])
        x = in_space(positions([body], [now])[0])
        found.append(Snapshot(body.name, x, body.facets, kind, {"displacement": u, "velocity": velocity}))
    return found
