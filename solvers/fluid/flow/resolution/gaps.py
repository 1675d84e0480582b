"""Gaps between surfaces, and between surfaces and the box, in cells.

The gap at a point x of a surface is the diameter of the largest ball in front of it that touches the surface there and
has no other point of a facing surface in it. Balls shrink: as long as a point q is in the ball around x + r n, the one
through q, r = |q - x|^2 / (2 n (q - x)), takes its place.
Source: J. Ma, S. W. Bae, S. Choi, The Visual Computer 28 (2012) 7-19.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from solvers.api import Array
from solvers.fluid.grid.box import Grid
from solvers.mesh.tessellation import area_vectors

#: Cosine of the largest angle between the normal of a wall and the direction to the opposite one.
ACROSS = 0.7
#: Pieces of facets from which on none is halved: long facets, or flat cells, would cost more than the flow.
ENOUGH_PIECES = 5_000
#: Points closest to the middle of a ball, of which one that faces the wall counts first: at corners, others are close.
NEAREST_POINTS = 8
#: Balls that are tried at most: five to ten are needed.
MOST_BALLS = 40


@dataclass(frozen=True)
class SurfaceSamples:
    """Points on facets, about a cell apart at most."""

    x: Array  #: (n, dim) [m]
    normal: Array  #: unit normals out of the bodies
    area: Array  #: [m^(dim-1)]
    facet: NDArray[np.int64]
    across: Array  #: length of a cell along the normal [m]
    covers: Array  #: how many cells it covers: its area in the lattice, a cell of which has the size 1
    index: Array  #: x counted in cells, (n, dim)

    def __getitem__(self, some: NDArray) -> SurfaceSamples:
        return SurfaceSamples(*(getattr(self, one.name)[some] for one in fields(self)))


@dataclass(frozen=True)
class WallPlane:
    """A face of the box as a wall; mirror: a plane of symmetry, with the image of the surface behind it."""

    axis: int
    side: int  #: 0: low, 1: high
    mirror: bool = False


@dataclass(frozen=True)
class SampledGaps:
    """The gap in front of each sample."""

    cells: Array  #: across the gap; infinite where nothing is opposite
    partner: NDArray[np.int64]  #: number of the sample opposite, -1 - number of the plane, or of itself: nothing


def samples_of(grid: Grid, corners: Array) -> SurfaceSamples:
    """The middles of facets in the box, halved until none is longer than a cell; corners: (facets, dim, dim) [m].

    Cells are counted along each edge, so that neither the other side of a slender facet nor of a flat cell matters.
    """
    pieces, facet = _halved(grid, corners)
    vector = area_vectors(pieces)
    area = np.linalg.norm(vector, axis=1)
    normal = np.divide(vector, area[:, None], out=np.zeros_like(vector), where=area[:, None] > 0.0)
    x = pieces.mean(axis=1)
    sizes = _sizes(grid, x)
    across = 1.0 / np.maximum(np.linalg.norm(normal / sizes, axis=1), 1e-300)
    covers = area * np.linalg.norm(normal * sizes, axis=1) / sizes.prod(axis=1)  # area vectors map by cofactors
    found = SurfaceSamples(x, normal, area, facet, across, covers, _index(grid, x))
    low, high = (np.array([edge[end] for edge in grid.edges]) for end in (0, -1))
    near = 1e-6 * (high - low)
    return found[((x > low + near) & (x < high - near)).all(axis=1) & (found.area > 0.0)]


def _halved(grid: Grid, corners: Array) -> tuple[Array, NDArray[np.int64]]:
    """(corners of the pieces, facet of each): the edge with most cells is halved while it has more than one.

    Pieces outside of the box are left out.
    """
    dim = corners.shape[2]
    left, facet = corners, np.arange(len(corners))
    low, high = (np.array([edge[end] for edge in grid.edges]) for end in (0, -1))
    pieces, of_facet = [np.empty((0, dim, dim))], [np.empty(0, dtype=np.int64)]
    while len(left):
        enough = len(left) + sum(map(len, pieces)) > ENOUGH_PIECES
        inside = ((left.max(axis=1) > low) & (left.min(axis=1) < high)).all(axis=1)
        left, facet = left[inside], facet[inside]
        index = _index(grid, left.reshape(-1, dim)).reshape(left.shape)
        cells = np.linalg.norm(np.roll(index, -1, axis=1) - index, axis=2)
        short = enough | (cells.max(axis=1) <= 1.0)
        pieces.append(left[short])
        of_facet.append(facet[short])
        left, facet, first = left[~short], facet[~short], cells[~short].argmax(axis=1)
        each, second = np.arange(len(left)), (first + 1) % dim
        middle = 0.5 * (left[each, first] + left[each, second])
        halves = np.repeat(left[None], 2, axis=0)
        halves[0, each, first], halves[1, each, second] = middle, middle
        left, facet = halves.reshape(-1, dim, dim), np.tile(facet, 2)
    return np.concatenate(pieces), np.concatenate(of_facet)


def gaps(grid: Grid, samples: SurfaceSamples, planes: Sequence[WallPlane]) -> SampledGaps:
    """The gap in front of each sample, to another one that faces it or to a wall of the box."""
    width, partner = _to_surfaces(samples, float(max(edge[-1] - edge[0] for edge in grid.edges)))
    for number, plane in enumerate(planes):
        towards = samples.normal[:, plane.axis] * (1.0 if plane.side else -1.0)
        distance = np.abs(samples.x[:, plane.axis] - grid.edges[plane.axis][-plane.side])
        to_plane = distance * (2.0 if plane.mirror else 2.0 / (1.0 + np.maximum(towards, 0.0)))
        closer = (towards > ACROSS) & (to_plane < width)
        width, partner = np.where(closer, to_plane, width), np.where(closer, -1 - number, partner)
    mirrored = np.isin(partner, [-1 - number for number, plane in enumerate(planes) if plane.mirror])
    way = np.where(mirrored, 0.5, 1.0) * np.where(np.isfinite(width), width, 0.0)
    ends = samples.x + way[:, None] * samples.normal
    passed = np.linalg.norm(_index(grid, ends) - _index(grid, samples.x), axis=1)
    return SampledGaps(np.where(np.isfinite(width), np.where(mirrored, 2.0, 1.0) * passed, np.inf), partner)


def _to_surfaces(samples: SurfaceSamples, farthest: float) -> tuple[Array, NDArray[np.int64]]:
    """(widths [m], infinite where no facing sample is closer than the farthest, numbers of the facing samples)."""
    count = len(samples.x)
    width, partner, radius = np.full(count, np.inf), np.arange(count), np.full(count, 0.5 * farthest)
    left, nearest = np.arange(count), min(NEAREST_POINTS, count)
    tree = cKDTree(samples.x) if count else None
    for _ in range(MOST_BALLS):
        if tree is None or not len(left):
            break
        x, n, r = samples.x[left], samples.normal[left], radius[left]
        distance, q = (found.reshape(len(left), nearest) for found in tree.query(x + r[:, None] * n, nearest))
        inside = distance < (r * (1.0 - 1e-6))[:, None]
        facing = -np.einsum("ni,nki->nk", n, samples.normal[q])
        first = np.argmax(inside & (facing > ACROSS), axis=1)  # the closest that faces it, else the closest
        some = np.flatnonzero(inside[:, 0])
        left, x, n, q, facing = left[some], x[some], n[some], q[some, first[some]], facing[some, first[some]]
        away = samples.x[q] - x
        along = np.einsum("ni,ni->n", away, n)
        radius[left] = np.divide((away**2).sum(axis=1), 2.0 * along, out=0.5 * radius[left], where=along > 0.0)
        # the plane of the other facet is closer than its point, where points are farther apart than the gap is wide
        plane = -2.0 * np.einsum("ni,ni->n", away, samples.normal[q]) / (1.0 + np.maximum(facing, 0.0))
        found = (facing > ACROSS) & (plane > 0.0)
        width[left[found]] = np.minimum(plane, 2.0 * radius[left])[found]
        partner[left[found]] = q[found]
    return width, partner


def _index(grid: Grid, x: Array) -> Array:
    """Positions counted in cells along each axis, which go on outside of the box as they are at its faces."""
    inside = [np.interp(x[:, i], edge, np.arange(len(edge))) for i, edge in enumerate(grid.edges)]
    beyond = x - np.clip(x, [edge[0] for edge in grid.edges], [edge[-1] for edge in grid.edges])
    return np.stack(inside, axis=1) + beyond / _sizes(grid, x)


def _sizes(grid: Grid, x: Array) -> Array:
    """Edge lengths [m] of the cells at points, (n, dim)."""
    at = [np.clip(np.searchsorted(edge, x[:, i]) - 1, 0, len(edge) - 2) for i, edge in enumerate(grid.edges)]
    return np.stack([np.diff(edge)[index] for edge, index in zip(grid.edges, at, strict=True)], axis=1)
