"""Named surfaces of bodies that may come into contact: those that face each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from solvers.mesh.mesh import Mesh
from solvers.mesh.periods import periods_before, way_of
from solvers.mesh.tessellation import area_vectors, is_closed, tessellate
from solvers.mesh.topology import surface_facets

Array = NDArray[np.float64]

#: How far facets may lie behind each other and still see each other, as a share of their size: surfaces that touch, of
#: meshes that do not match, cross a little.
CROSSING_FACETS = 0.05

#: Product of the normals of facets that face each other: less than this. From -0.05 to -0.5 results are the same.
FACING_NORMALS = -0.2

#: Facets of one surface that are looked at together.
FACING_AT_ONCE = 256


@dataclass(frozen=True)
class Face:
    """A named surface by its flat pieces, as the mesh has it."""

    name: str
    middles: Array  #: of its simplices [m], shape (m, dim)
    normals: Array  #: outward, of unit length, shape (m, dim)
    size: float  #: mean extent of a simplex [m]
    cavity: bool  #: it encloses a hole in the body

    @property
    def box(self) -> tuple[Array, Array]:
        return self.middles.min(axis=0), self.middles.max(axis=0)

    def moved(self, way: Array) -> Face:
        return replace(self, middles=self.middles + way)


def face(mesh: Mesh, names: Sequence[str] | None) -> Face:
    """Named surfaces of a mesh as one, or all of its boundary."""
    simplices, nodes = tessellate(mesh, names)
    x = mesh.points[nodes][simplices]
    along = area_vectors(x)
    measure = np.linalg.norm(along, axis=1)
    middles = x.mean(axis=1)
    volume = np.einsum("md,md->", middles - middles.mean(axis=0), along)
    size = float(measure.mean() ** (1.0 / (x.shape[2] - 1)))
    return Face(" + ".join(names or ()), middles, along / measure[:, None], size, is_closed(simplices) and volume < 0.0)


def faces(mesh: Mesh) -> list[Face]:
    """Named surfaces that overlap no smaller one."""
    found: list[Face] = []
    known: set[tuple[int, ...]] = set()
    for name in sorted(mesh.surfaces, key=lambda name: (len(mesh.surfaces[name]), name)):
        try:
            facets = {tuple(facet) for facet in np.sort(surface_facets(mesh, name), axis=1).tolist()}
        except ValueError:  # it lies inside of the body
            continue
        if facets and not facets & known:
            found.append(face(mesh, [name]))
            known |= facets
    return found


def meeting(
    first: Sequence[Face], second: Sequence[Face], reach: float | None = None, *, anywhere: bool = False
) -> list[tuple[Face, Face]]:
    """Surfaces of two bodies that may touch. A surface within a cavity may touch that cavity only.

    anywhere: one of the bodies may come to any side of the other one; else they face each other.
    """
    hulls = [_hull(first), _hull(second)]
    sides = []
    for own, other in ((first, hulls[1]), (second, hulls[0])):
        around = [face for face in own if face.cavity and _contains(face.box, other)]
        sides.append(around or [face for face in own if not face.cavity])
    found = _within if anywhere else face_each_other
    return [(a, b) for a in sides[0] for b in sides[1] if found(a, b, reach)]


def images(first: Sequence[Face], second: Sequence[Face], lengths: Array | None) -> list[list[Face]]:
    """The second surfaces, and their images that the first ones may meet where space repeats after `lengths` [m]."""
    if lengths is None or not first or not second:
        return [list(second)]
    before = periods_before(_hull(first), _hull(second), lengths)
    around = product(*((k, k + 1) if np.isfinite(L) else (0,) for k, L in zip(before.tolist(), lengths, strict=True)))
    return [[face.moved(way_of(periods, lengths)) for face in second] for periods in around]


def _within(a: Face, b: Face, reach: float | None) -> bool:
    """Some of their facets are at most so far [m] apart."""
    return reach is None or any(float(np.linalg.norm(b.middles - x, axis=1).min()) <= reach for x in a.middles)


def face_each_other(a: Face, b: Face, reach: float | None = None) -> bool:
    """Some of their facets face each other, each in front of the other, at most so far [m] apart (None: at will)."""
    behind = CROSSING_FACETS * min(a.size, b.size)
    for start in range(0, len(a.middles), FACING_AT_ONCE):
        part = slice(start, start + FACING_AT_ONCE)
        away = b.middles[None] - a.middles[part, None]
        found = a.normals[part] @ b.normals.T < FACING_NORMALS
        if reach is not None:
            found &= np.linalg.norm(away, axis=2) <= reach
        found &= np.einsum("ijd,id->ij", away, a.normals[part]) > -behind
        found &= np.einsum("ijd,jd->ij", away, b.normals) < behind
        if found.any():
            return True
    return False


def _hull(faces: Sequence[Face]) -> tuple[Array, Array]:
    low, high = zip(*(face.box for face in faces), strict=True)
    return np.min(low, axis=0), np.max(high, axis=0)


def _contains(outer: tuple[Array, Array], inner: tuple[Array, Array]) -> bool:
    return bool((outer[0] <= inner[0]).all() and (inner[1] <= outer[1]).all())
