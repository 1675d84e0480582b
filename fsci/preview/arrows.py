"""Which way loads act, and which way things that are moved begin to move, for the arrows of a preview."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fsci.builder.obstacle_motion import motion_of_obstacle
from fsci.case import Case
from fsci.case.supports import SupportSection
from fsci.expression import Expression
from solvers.api import Array
from solvers.mesh.tessellation import area_vectors

MOMENTS = 64  #: of the run, at which loads and motions are looked at
BEGUN = 0.05  #: a motion has begun when it has this share of its largest displacement
CANCELLED = 0.1  #: normals of a surface that add up to less than this share of its area have no common direction
AT_REST = 1e-12  #: displacements, relative to the size of what moves


@dataclass(frozen=True)
class Arrow:
    """Something with a direction at a point."""

    kind: str  #: traction, pressure, force, motion or velocity
    at: Array  #: [m], shape (dim,)
    direction: Array  #: of length one, shape (dim,)


def moments(case: Case) -> Array:
    """Times of the run [s], from its first to its last one; how a fast turn begins is seen in the early ones."""
    early, later = np.geomspace(1e-6, 1.0 / MOMENTS, MOMENTS), np.arange(2, MOMENTS + 1) / MOMENTS
    shares = np.concatenate([[0.0], early, later])
    return np.asarray(case.time.start + shares * (case.time.end - case.time.start))


def arrow_of_vector(kind: str, corners: Array, components: Sequence[Expression], times: Array) -> Arrow | None:
    """The mean over a surface of a vector given by formulas, when it is largest; None where it is zero.

    corners: of its segments or triangles, shape (n, dim, dim); of a point that the vector acts at, shape (1, 1, dim).
    """
    middles = corners.mean(axis=1)
    sizes = np.linalg.norm(area_vectors(corners), axis=1) if corners.shape[1] > 1 else np.ones(1)
    means = [sizes @ np.stack([formula(middles.T, t) for formula in components], axis=1) for t in times]
    return _arrow(kind, sizes @ middles / sizes.sum(), _largest(np.array(means)))


def arrow_of_pressure(corners: Array, formula: Expression, times: Array) -> Arrow | None:
    """Against the surface where the pressure is positive when it is largest; None where normals cancel."""
    middles, vectors = corners.mean(axis=1), area_vectors(corners)
    sizes = np.linalg.norm(vectors, axis=1)
    if np.linalg.norm(vectors.sum(axis=0)) < CANCELLED * sizes.sum():
        return None
    forces = np.array([-formula(middles.T, t) @ vectors for t in times])
    return _arrow("pressure", sizes @ middles / sizes.sum(), _largest(forces))


def arrow_of_motion(points: Array, motion: Callable[[float], Array], times: Array) -> Arrow | None:
    """How the point that moves farthest begins to; None for what stays where it is.

    points: at rest, shape (n, dim) [m]; motion: time [s] -> displacements, of the same shape [m].
    """
    moved = np.nan_to_num(np.stack([motion(float(t)) for t in times]), posinf=0.0, neginf=0.0)
    moved = moved - moved[0]
    lengths = np.linalg.norm(moved, axis=2)
    fastest = int(lengths.max(axis=0).argmax())
    largest = lengths[:, fastest].max()
    if largest <= AT_REST * max(float(np.ptp(points, axis=0).max()), float(np.abs(points).max())):
        return None
    begun = int(np.flatnonzero(lengths[:, fastest] >= BEGUN * largest)[0])
    # Of a translation all points move alike: the arrow is at the middle.
    alike = np.ptp(moved[begun], axis=0).max() <= 0.1 * largest * BEGUN
    return _arrow("motion", points.mean(axis=0) if alike else points[fastest], moved[begun, fastest])


def arrow_of_moved(case: Case, name: str, points: Array) -> Arrow | None:
    """Of a body of given motion, or of an obstacle, with these points at rest; None for one that stays there."""
    positions = motion_of_obstacle(case, name, points)
    return None if positions is None else arrow_of_motion(points, lambda t: positions(t) - points, moments(case))


def arrow_of_support(corners: Array, support: SupportSection, times: Array) -> Arrow | None:
    """Of a surface, shape (n, dim, dim), or a point, (1, 1, dim), that a support moves; None for one at rest."""
    points = corners.mean(axis=1)
    given = support.displacement
    if given is None:
        return None
    if isinstance(given, tuple):
        zero = np.zeros(len(points))
        return arrow_of_motion(
            points, lambda t: np.stack([zero if f is None else f(points.T, t) for f in given], axis=1), times
        )
    if support.direction is not None:
        along = np.broadcast_to(np.asarray(support.direction) / np.linalg.norm(support.direction), points.shape)
    else:
        vectors = area_vectors(corners)
        along = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    return arrow_of_motion(points, lambda t: given(points.T, t)[:, None] * along, times)


def _largest(vectors: Array) -> Array:
    """That of the largest length, shape (dim,)."""
    finite = np.nan_to_num(vectors, posinf=0.0, neginf=0.0)
    return np.asarray(finite[np.linalg.norm(finite, axis=1).argmax()])


def _arrow(kind: str, at: Array, vector: Array) -> Arrow | None:
    length = float(np.linalg.norm(vector))
    return None if length == 0.0 else Arrow(kind, np.asarray(at), vector / length)
