"""Cavities: closed parts of the surfaces of bodies with fluid inside, such as the hole of a ring.

The volume of the fluid in a cavity follows from the surfaces alone, by the divergence theorem. It is exact on any grid,
also where the grid does not separate both sides of the wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices
from solvers.fluid.geometry.pieces import NOTHING
from solvers.fluid.surfaces.inside import windings
from solvers.fluid.surfaces.surface import Motion

#: Points of a surface or region that are tested for lying in a cavity.
TESTED = 32


@dataclass(frozen=True)
class Cavity:
    """A cavity, with the surfaces of the bodies in it."""

    wall: Indices  #: facets of the surface that encloses it
    facets: (
        Indices  #: those, and the facets of the surfaces in it: minus the volume that they enclose is that of the fluid
    )


def enclosed(x: Array, facets: Indices) -> float:
    """Volume [m^3] inside of closed surfaces, negative if normals point inwards. x: vertices [m]."""
    corners = x[facets] - x[facets[0, 0]]
    if corners.shape[2] == 2:
        return float(0.5 * (corners[:, 0, 0] * corners[:, 1, 1] - corners[:, 0, 1] * corners[:, 1, 0]).sum())
    return float(np.linalg.det(corners).sum() / 6.0)


def vector_area(x: Array, facets: Indices) -> tuple[Array, float]:
    """(sum of area times normal, sum of areas) [m^2] of facets; the first is zero for closed surfaces."""
    corners = x[facets]
    along = corners[:, 1:] - corners[:, :1]
    if corners.shape[2] == 2:
        normal = np.stack([along[:, 0, 1], -along[:, 0, 0]], axis=1)
    else:
        normal = 0.5 * np.cross(along[:, 0], along[:, 1])
    return normal.sum(axis=0), float(np.linalg.norm(normal, axis=1).sum())


def components(facets: Indices, vertices: int) -> Indices:
    """Number of the connected part of each facet, from 0 on in the order of their facets."""
    first = np.concatenate([facets[:, :1]] * (facets.shape[1] - 1)).ravel()
    part = connected_parts(first, facets[:, 1:].T.ravel(), vertices)[facets[:, 0]]
    return np.unique(part, return_inverse=True)[1].reshape(-1)


def find_cavities(facets: Indices, x: Array, wet: NDArray[np.bool_], box: Sequence[Array]) -> list[Cavity]:
    """The cavities of surfaces with vertices at x [m]; wet: facets that the fluid acts on; box: corners of the box [m].

    Without those that reach beyond the box, and those whose surface meets that of another body.
    """
    part = components(facets, len(x))
    members = [np.flatnonzero(part == number) for number in range(int(part.max(initial=-1)) + 1)]
    sizes = [enclosed(x, facets[some]) if _is_closed(x, facets[some]) else 0.0 for some in members]
    found = []
    for number, wall in enumerate(members):
        at = x[facets[wall]].reshape(-1, x.shape[1])
        if sizes[number] >= 0.0 or not wet[wall].all() or (at < box[0]).any() or (at > box[1]).any():
            continue
        shares = [
            0.0 if other == number else _share_inside(x, facets, wall, members[other]) for other in range(len(members))
        ]
        if any(0.0 < share < 1.0 for share in shares):
            continue
        inside = [other for other, share in enumerate(shares) if share == 1.0]
        # what is in a body in the cavity, or in a smaller cavity of its wall's body, is not in this fluid
        direct = [
            other
            for other in inside
            if not any(_share_inside(x, facets, members[o], members[other]) for o in inside if o != other)
        ]
        found.append(Cavity(wall, np.concatenate([wall, *(members[other] for other in direct)])))
    return found


def _is_closed(x: Array, facets: Indices) -> bool:
    total, size = vector_area(x, facets)
    return bool(np.linalg.norm(total) <= NOTHING * size)


def _share_inside(x: Array, facets: Indices, wall: Indices, other: Indices) -> float:
    """Share of some vertices of a surface that lie inside of another closed one."""
    inside = points_inside(x[evenly(np.unique(facets[other]), TESTED)], x, facets[wall])
    return float(inside.mean())


def evenly(numbers: Indices, count: int) -> Indices:
    """At most so many of some numbers, evenly spaced among them."""
    return numbers[np.unique(np.linspace(0, len(numbers) - 1, count).astype(np.int64))] if len(numbers) else numbers


def points_inside(points: Array, x: Array, wall: Indices) -> NDArray[np.bool_]:
    """Whether points [m] lie inside of a closed surface, whichever way its normals point."""
    at, motion = x[wall].reshape(-1, x.shape[1]), Motion(x, x)
    inside = ((points >= at.min(axis=0)) & (points <= at.max(axis=0))).all(axis=1)
    inside[inside] = np.abs(windings(points[inside], motion, wall)) > 0.5
    return inside
