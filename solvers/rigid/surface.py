"""Surfaces of rigid bodies: positions of the vertices, their derivative by the unknowns, resultants of forces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.vertices import VertexJacobian
from solvers.api import Array
from solvers.rigid.body import RigidBody, in_space
from solvers.rigid.motion import RigidInstant


def positions(bodies: Sequence[RigidBody], instants: Sequence[RigidInstant]) -> list[Array]:
    """Positions [m] of the vertices of each body, shape (n, dim)."""
    pairs = zip(bodies, instants, strict=True)
    return [body.inertia.centre + (now.shift + body.arms(now.R, body.points))[:, : body.dim] for body, now in pairs]


def displacements(bodies: Sequence[RigidBody], instants: Sequence[RigidInstant]) -> Array:
    """Displacements [m] of all vertices since the start, shape (n, dim).

    They are not differences of positions, whose rounding errors grow with the distance from the origin: a flow
    divides displacements by the time step.
    """
    at_start = np.eye(3)
    pairs = zip(bodies, instants, strict=True)
    return np.concatenate(
        [(now.shift + body.arms(now.R - at_start, body.points))[:, : body.dim] for body, now in pairs]
    )


def jacobian(
    bodies: Sequence[RigidBody], instants: Sequence[RigidInstant], components: NDArray[np.int64]
) -> VertexJacobian:
    """Derivative of the displacements of all vertices, dc + w x r: 2 entries per row in 2D, 4 in 3D.

    components: the unknowns of a body among `COMPONENTS`.
    """
    dim, columns, values = bodies[0].dim, [], []
    axes, turns = np.arange(dim), np.arange(dim, len(components))
    for index, (body, now) in enumerate(zip(bodies, instants, strict=True)):
        r = body.arms(now.R, body.points)
        swept = np.cross(np.eye(3)[None, :, :], r[:, None, :])  # (n, axis of rotation, component)
        by_turn = swept[:, components[turns] - 3, :dim].transpose(0, 2, 1)
        first, n = index * len(components), len(r)
        by_axis = np.broadcast_to(first + axes[None, :, None], (n, dim, 1))
        columns.append(np.concatenate([by_axis, np.broadcast_to(first + turns, (n, dim, len(turns)))], axis=2))
        values.append(np.concatenate([np.ones((n, dim, 1)), by_turn], axis=2))
    entries = 1 + len(turns)
    return VertexJacobian(*(np.concatenate(parts).reshape(-1, entries) for parts in (columns, values)))


def resultants(bodies: Sequence[RigidBody], instants: Sequence[RigidInstant], forces: Sequence[Array]) -> Array:
    """Forces [N] and moments about the centres [N m], shape (bodies, 6); forces: on the vertices by body, (n, dim)."""
    found = []
    for body, now, given in zip(bodies, instants, forces, strict=True):
        f = in_space(given)
        found.append(np.concatenate([f.sum(axis=0), np.cross(body.arms(now.R, body.points), f).sum(axis=0)]))
    return np.array(found)


def turned(body: RigidBody, now: RigidInstant, points: Array, force: Array) -> Array:
    """Derivative of the moment of forces on points by a rotation, sum of r f^T - (f . r) 1, shape (3, 3)."""
    found = body.arms(now.R, points).T @ in_space(force)
    return np.asarray(found - np.trace(found) * np.eye(3))


def turned_blocks(
    bodies: Sequence[RigidBody],
    instants: Sequence[RigidInstant],
    forces: Sequence[Array],
    components: NDArray[np.int64],
) -> Array:
    """`turned` of each body, in the places of its unknowns, shape (bodies, unknowns of a body, unknowns of a body).

    forces: on the vertices by body; components: the unknowns of a body among its six.
    """
    found = np.zeros((len(bodies), 6, 6))
    for block, body, now, force in zip(found, bodies, instants, forces, strict=True):
        block[3:, 3:] = turned(body, now, body.points, force)
    return found[:, components[:, None], components]
