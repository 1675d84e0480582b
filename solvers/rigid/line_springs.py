"""Springs with dampers between points of two rigid bodies, or of a body and a point at rest.

With the vector d from the second point to the first one, its length L and e = d / L, the force on the first point is

    F = -(k (L - L_0) + c e . d') e,    and   F = -k d - c d'   without a length, L_0 = 0,

which holds the points together in all directions. The second point has -F, so momentum is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array
from solvers.rigid.body import RigidBody, in_space
from solvers.rigid.motion import RigidInstant, spin
from solvers.rigid.rotation import skew


@dataclass(frozen=True)
class LineSpring:
    """A spring and a damper between two points."""

    body: int  #: index of the body of the first point
    at: Sequence[float]  #: the first point at the start [m], shape (dim,)
    other: int | None  #: index of the body of the second point; None: it is at rest
    to: Sequence[float]  #: the second point at the start [m], shape (dim,)
    stiffness: float  #: k [N/m]; in 2D per depth
    damping: float  #: c [N s/m]; in 2D per depth
    length: float  #: L_0 without force [m]


@dataclass(frozen=True)
class _End:
    """One end of a spring."""

    body: int | None
    x: Array  #: [m], shape (3,)
    v: Array  #: [m/s], shape (3,)
    arm: Array  #: from the centre of its body [m], shape (3,)
    turning: Array  #: angular velocity of its body [rad/s], shape (3,)


def with_springs(
    springs: Sequence[LineSpring], bodies: Sequence[RigidBody], instants: Sequence[RigidInstant]
) -> list[RigidInstant]:
    """The instants, with the forces of springs in their loads."""
    if not springs:
        return list(instants)
    loads = [now.load.copy() for now in instants]
    for spring in springs:
        ends = _ends(spring, bodies, instants)
        force = _force(spring, *ends)[0]
        for end, f in zip(ends, (force, -force), strict=True):
            if end.body is not None:
                loads[end.body] += np.concatenate([f, np.cross(end.arm, f)])
    return [replace(now, load=load) for now, load in zip(instants, loads, strict=True)]


def tangent(
    springs: Sequence[LineSpring],
    bodies: Sequence[RigidBody],
    instants: Sequence[RigidInstant],
    rates: Sequence[Array],
    components: NDArray[np.int64],
    free: NDArray[np.bool_],
) -> Sparse:
    """Derivative of the loads of springs by the unknowns: displacements of centres and further rotations.

    rates: derivatives of the velocities by the same, as in `RigidBody.own_load_tangent`; components: the unknowns of a
    body among its six; free: mask of the unknowns, others have empty rows and columns.
    """
    n = len(components)
    rows, columns, entries = [], [], []
    for spring in springs:
        ends = _ends(spring, bodies, instants)
        force, by_d, by_rate = _force(spring, *ends)
        signed = [(end, end.body, sign) for end, sign in zip(ends, (1.0, -1.0), strict=True) if end.body is not None]
        for end, row, sign in signed:
            by_place = _by_place(end)
            for other, column, other_sign in signed:
                place = _by_place(other)
                speed = place @ rates[column]
                speed[:, 3:] -= skew(other.turning) @ skew(other.arm)
                block = sign * other_sign * by_place.T @ (by_d @ place + by_rate @ speed)
                if other is end:
                    block[3:, 3:] += sign * skew(force) @ skew(end.arm)
                grid = np.meshgrid(n * row + np.arange(n), n * column + np.arange(n), indexing="ij")
                rows.append(grid[0].ravel())
                columns.append(grid[1].ravel())
                entries.append(
                    np.where(free[grid[0]] & free[grid[1]], block[np.ix_(components, components)], 0.0).ravel()
                )
    row, column, entry = (np.concatenate(part) for part in (rows, columns, entries))
    return sparse_from_entries(row, column, entry, (len(free), len(free)))


def _by_place(end: _End) -> Array:
    """Derivative of the place of an end by the unknowns of its body, shape (3, 6)."""
    return np.hstack([np.eye(3), -skew(end.arm)])


def _ends(spring: LineSpring, bodies: Sequence[RigidBody], instants: Sequence[RigidInstant]) -> tuple[_End, _End]:
    return (
        _end(spring.body, spring.at, bodies, instants),
        _end(spring.other, spring.to, bodies, instants),
    )


def _end(
    index: int | None, point: Sequence[float], bodies: Sequence[RigidBody], instants: Sequence[RigidInstant]
) -> _End:
    at = np.array([point], dtype=float)
    if index is None:
        return _End(None, in_space(at)[0], np.zeros(3), np.zeros(3), np.zeros(3))
    body, now = bodies[index], instants[index]
    arm, turning = body.arms(now.R, at)[0], spin(now)
    x = in_space(body.inertia.centre[None])[0] + now.shift + arm
    return _End(index, x, now.v[:3] + np.cross(turning, arm), arm, turning)


def _force(spring: LineSpring, first: _End, second: _End) -> tuple[Array, Array, Array]:
    """(force on the first end [N], its derivative by d [N/m], by d' [N s/m]), shapes (3,), (3, 3), (3, 3)."""
    d, rate, k, c = first.x - second.x, first.v - second.v, spring.stiffness, spring.damping
    length = float(np.linalg.norm(d))
    if spring.length == 0.0 or length == 0.0:
        return -k * d - c * rate, -k * np.eye(3), -c * np.eye(3)
    e = d / length
    turned = (np.eye(3) - np.outer(e, e)) / length
    tension = k * (length - spring.length) + c * e @ rate
    by_d = -np.outer(e, k * e + c * rate @ turned) - tension * turned
    return -tension * e, by_d, -c * np.outer(e, e)
