"""Images of bodies: what the fluid in a box with periodic faces sees of surfaces that are, or cross, anywhere.

A part of a surface acts at each position x + k . L, k whole numbers, L the periods, that is within the box. The images
have the velocity of the part, and forces on them are forces on it. So bodies cross the ends of the box on their own,
each at its own time, and may go through any number of periods.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from solvers.api import Array, FailureKind, Indices, StepFailed
from solvers.fluid.grid.box import FLUSH, Grid
from solvers.fluid.surfaces.surface import Motion
from solvers.mesh.tessellation import unit_normals


@dataclass(frozen=True)
class Images:
    """Surfaces in or near the box. Without periods they are the surfaces themselves."""

    facets: NDArray[np.int64]  #: vertices, numbered among those of the images, shape (m, dim)
    x: Array  #: positions of their vertices [m], shape (n, dim)
    facet: Indices  #: number of each facet among those of the surfaces, shape (m,)
    vertex: Indices  #: number of each vertex among those of the surfaces, shape (n,)

    def motion(self, motion: Motion) -> Motion:
        """The motion of the images, from that of the surfaces."""
        return Motion(self.x, motion.v[self.vertex])

    def require_bodies(self, facets: NDArray[np.int64], x: Array) -> None:
        """Raise StepFailed if these are not the surfaces themselves: cells of the sides of thin bodies have none."""
        if not (np.array_equal(facets, self.facets) and np.array_equal(x, self.x)):
            reason = "a body beside thin ones reaches a periodic face: take a longer box, or end earlier"
            raise StepFailed("fluid", FailureKind.PERIODIC_FACES, reason)


@dataclass(frozen=True)
class Periods:
    """The periods of a box."""

    grid: Grid
    axes: tuple[int, ...]  #: periodic axes

    @property
    def lengths(self) -> Array:
        """L of each direction [m], infinite where nothing repeats, shape (dim,)."""
        return np.array([
            edge[-1] - edge[0] if axis in self.axes else np.inf for axis, edge in enumerate(self.grid.edges)
        ])  # fmt: skip

    def home(self, x: Array) -> Array:
        """The way [m] by whole periods that brings the middle of vertices (n, dim) into the box, shape (dim,)."""
        way = np.zeros(self.grid.dim)
        for axis in self.axes:
            edge = self.grid.edges[axis]
            middle = 0.5 * (x[:, axis].min() + x[:, axis].max())
            way[axis] = -np.floor((middle - edge[0]) / self.lengths[axis]) * self.lengths[axis]
        return way

    def within(self, x: Array) -> Array:
        """Points [m], (n, dim), put into the box by whole periods."""
        found = x.copy()
        for axis in self.axes:
            start, length = self.grid.edges[axis][0], self.lengths[axis]
            found[:, axis] = start + (x[:, axis] - start) % length
        return found

    def images(self, facets: NDArray[np.int64], x: Array, layers: int) -> Images:
        """The images in the box and so many layers of cells around it.

        Raises StepFailed if a part of a surface is as long as the period: it would meet its own image.
        """
        every = np.arange(len(facets)), np.arange(len(x))
        if not self.axes or not len(facets):
            return Images(facets, x, *every)
        shifts = self._shifts(facets, x, layers)
        if list(shifts) == [(0,) * len(self.axes)] and shifts[(0,) * len(self.axes)].all():
            return Images(facets, x, *every)
        parts, places, count = [facets[:0]], [x[:0]], 0
        facet, vertex = ([some[:0]] for some in every)
        for shift, those in shifts.items():
            used, corners = np.unique(facets[those], return_inverse=True)
            way = np.zeros(x.shape[1])
            way[list(self.axes)] = np.array(shift) * self.lengths[list(self.axes)]
            parts.append(corners.reshape(-1, facets.shape[1]) + count)
            places.append(x[used] + way)
            facet.append(np.flatnonzero(those))
            vertex.append(used)
            count += len(used)
        return Images(*(np.concatenate(some) for some in (parts, places, facet, vertex)))

    def _shifts(self, facets: NDArray[np.int64], x: Array, layers: int) -> dict[tuple[int, ...], NDArray[np.bool_]]:
        """Masks of the facets that have an image in the box, by its distance in periods."""
        part = _parts(facets, len(x))
        count = int(part.max()) + 1
        found: dict[tuple[int, ...], NDArray[np.bool_]] = {}
        spans = []
        for axis in self.axes:
            edge, length = self.grid.edges[axis], self.lengths[axis]
            margin = layers * float(np.diff(edge).max())
            of_facet = x[facets, axis]
            low, high = np.full(count, np.inf), np.full(count, -np.inf)
            np.minimum.at(low, part, of_facet.min(axis=1))
            np.maximum.at(high, part, of_facet.max(axis=1))
            if (high - low >= length - FLUSH * float(np.diff(edge).min())).any():
                self._fail_as_long(axis)
            first = np.ceil((edge[0] - margin - high) / length).astype(int)
            last = np.floor((edge[-1] + margin - low) / length).astype(int)
            spans.append((first, last))
        for number in range(count):
            for shift in product(*(range(first[number], last[number] + 1) for first, last in spans)):
                found.setdefault(shift, np.zeros(len(facets), dtype=bool))[part == number] = True
        return dict(sorted(found.items()))

    def _fail_as_long(self, axis: int) -> None:
        name = "xyz"[axis]
        reason = f"a body is as long as the period between {name}- and {name}+: take a longer box, or a shorter body"
        raise StepFailed("fluid", FailureKind.PERIODIC_FACES, reason)

    def inwards(self, images: Images) -> NDArray[np.bool_]:
        """Mask of the facets of images, without those that lie in a periodic face and bound fluid beyond it."""
        found, corners = np.ones(len(images.facets), dtype=bool), images.x[images.facets]
        for axis in self.axes:
            edge = self.grid.edges[axis]
            near = FLUSH * float(np.diff(edge).min())
            for end, beyond in ((edge[0], -1.0), (edge[-1], 1.0)):
                flush = np.flatnonzero((np.abs(corners[:, :, axis] - end) <= near).all(axis=1))
                if len(flush):
                    found[flush] = beyond * _along(corners[flush], axis) < 0.0
        return found


def _along(corners: Array, axis: int) -> Array:
    """Component of the normals of facets out of the solid."""
    found: Array = unit_normals(corners)[:, axis]
    return found


def _parts(facets: NDArray[np.int64], vertices: int) -> Indices:
    """Number of the connected part of each facet."""
    first = np.concatenate([facets[:, :1]] * (facets.shape[1] - 1)).ravel()
    links = sparse.coo_matrix((np.ones(len(first)), (first, facets[:, 1:].T.ravel())), shape=(vertices, vertices))
    part = connected_components(links, directed=False)[1][facets[:, 0]]
    return np.unique(part, return_inverse=True)[1].reshape(-1)
