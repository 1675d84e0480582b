"""Springs with dampers between points of two rigid bodies, of a body and a point at rest, or of another field.

Their law is `solvers.spring_law`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array
from solvers.rigid.body import RigidBody, in_space
from solvers.rigid.motion import RigidInstant, spin
from solvers.rigid.rotation import skew
from solvers.spring_law import PointMotion, SpringLaw


@dataclass(frozen=True)
class LineSpring:
    """A spring and a damper between two points."""

    body: int  #: index of the body of the first point
    at: Sequence[float]  #: the first point at the start [m], shape (dim,)
    #: index of the body of the second point, or the motion of a point of another field; None: it is at rest
    other: int | PointMotion | None
    to: Sequence[float]  #: the second point at the start [m], shape (dim,)
    law: SpringLaw


class BodiesNow(Protocol):
    """Bodies at present; `RigidBodies` is one."""

    bodies: list[RigidBody]
    now: list[RigidInstant]


@dataclass(frozen=True)
class _End:
    """One end of a spring."""

    body: int | None
    x: Array  #: [m], shape (3,)
    v: Array  #: [m/s], shape (3,)
    arm: Array  #: from the centre of its body [m], shape (3,)
    turning: Array  #: angular velocity of its body [rad/s], shape (3,)


def joined(springs: Sequence[LineSpring]) -> NDArray[np.int64]:
    """Pairs of bodies that springs join, shape (n, 2)."""
    found = [(spring.body, spring.other) for spring in springs if isinstance(spring.other, int)]
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def with_springs(
    springs: Sequence[LineSpring], bodies: Sequence[RigidBody], instants: Sequence[RigidInstant]
) -> list[RigidInstant]:
    """The instants, with the forces of springs in their loads."""
    if not springs:
        return list(instants)
    loads = [now.load.copy() for now in instants]
    for spring in springs:
        ends = _ends(spring, bodies, instants)
        force = _force(spring.law, *ends)[0]
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
        force, by_d, by_rate = _force(spring.law, *ends)
        signed = [(end, end.body, sign) for end, sign in zip(ends, (1.0, -1.0), strict=True) if end.body is not None]
        for end, row, sign in signed:
            by_place = _by_place(end)
            for other, column, other_sign in signed:
                place, speed = _by_motion(other, rates[column])
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


def point_motion(field: BodiesNow, index: int, at: Sequence[float]) -> tuple[Array, Array]:
    """Position [m] and velocity [m/s] of a point of a body at present, each of shape (3,)."""
    end = _end(index, at, field.bodies, field.now)
    return end.x, end.v


def by_unknowns(field: BodiesNow, index: int, at: Sequence[float], rate: Array) -> tuple[Array, Array]:
    """Derivatives of position and velocity of a point by the six unknowns of its body, each of shape (3, 6).

    rate: that of the velocities of the body by the same.
    """
    return _by_motion(_end(index, at, field.bodies, field.now), rate)


def _by_place(end: _End) -> Array:
    """Derivative of the place of an end by the unknowns of its body, shape (3, 6)."""
    return np.hstack([np.eye(3), -skew(end.arm)])


def _by_motion(end: _End, rate: Array) -> tuple[Array, Array]:
    """The same, and that of its velocity; rate: of the velocities of the body."""
    place = _by_place(end)
    speed = place @ rate
    speed[:, 3:] -= skew(end.turning) @ skew(end.arm)
    return place, speed


def _ends(spring: LineSpring, bodies: Sequence[RigidBody], instants: Sequence[RigidInstant]) -> tuple[_End, _End]:
    return (
        _end(spring.body, spring.at, bodies, instants),
        _end(spring.other, spring.to, bodies, instants),
    )


def _end(
    index: int | PointMotion | None,
    point: Sequence[float],
    bodies: Sequence[RigidBody],
    instants: Sequence[RigidInstant],
) -> _End:
    if callable(index):
        return _End(None, *index(), np.zeros(3), np.zeros(3))
    at = np.array([point], dtype=float)
    if index is None:
        return _End(None, in_space(at)[0], np.zeros(3), np.zeros(3), np.zeros(3))
    body, now = bodies[index], instants[index]
    arm, turning = body.arms(now.R, at)[0], spin(now)
    x = in_space(body.inertia.centre[None])[0] + now.shift + arm
    return _End(index, x, now.v[:3] + np.cross(turning, arm), arm, turning)


def _force(law: SpringLaw, first: _End, second: _End) -> tuple[Array, Array, Array]:
    """(force on the first end [N], its derivative by d [N/m], by d' [N s/m]), see `SpringLaw.force`."""
    return law.force(first.x - second.x, first.v - second.v)
