"""Facets of a surface divided where another surface that is tied to it lies on them.

The parts of a facet have vertices that are fixed mixtures of its corners, so that they move with it. What lies under
the other surface is tied, and no fluid touches it; the rest is wet up to the edge of the other surface. Both sides are
divided along the edges of both, so that their parts have the same vertices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from coupling.conforming_facets import conforming
from solvers.algebra.connected import connected_parts
from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array, Indices
from solvers.mesh.search import OPPOSED
from solvers.mesh.tessellation import unit_normals

#: Length in sizes of a facet below which its parts have no extent.
NO_LENGTH = 1e-6
#: Distance in sizes of a facet up to which the other side of a tie lies on it: arcs of coarse meshes are farther apart
#: than rounding, other surfaces of the same body are a facet away. From 0.05 on the tests do not depend on it.
ON_IT = 0.5
#: Share of a facet below which its free part, or its covered one, does not count: edges of both sides of a bent tie lie
#: beside each other, by their arcs. From 1e-5 on the tests do not depend on it.
LEAST_PART = 1e-2


@dataclass(frozen=True)
class DividedFacets:
    """A surface some of whose facets are divided."""

    facets: Indices  #: vertices of segments or triangles, shape (m, dim)
    parents: Indices  #: the facet that each is a part of, shape (m,)
    tied: NDArray[np.bool_]  #: facets that lie on the other side of a tie, shape (m,)
    mixture: Sparse | None  #: vertices from those of the whole facets, (n, vertices); None: no new ones


def divide_facets(x: Array, facets: Indices, candidates: Sequence[tuple[NDArray[np.bool_], Array]]) -> DividedFacets:
    """Divide facets where other surfaces lie on them.

    x: vertices [m], shape (n, dim). candidates: for each tie the mask of the facets that belong to it, and the corners
    of the facets of its other side [m], shape (k, dim, dim).
    """
    kept, parents, tied = [facets], [np.arange(len(facets))], np.zeros(len(facets), dtype=bool)
    divided, more_tied = np.zeros(len(facets), dtype=bool), []
    corners, shares, count = [], [], len(x)
    for facet in np.flatnonzero(np.any([mask for mask, _ in candidates], axis=0)).tolist():
        others = np.concatenate([other for mask, other in candidates if mask[facet]])
        free, covered = _divide(x[facets[facet]], others)
        if not covered or _size(covered) < LEAST_PART:
            continue
        slivers = free if free and _size(free) < LEAST_PART else []
        free = [] if slivers else free
        if not free and len(covered) == 1:
            tied[facet] = True
            continue
        covered = covered + slivers
        divided[facet] = True
        for polygon, on_it in [(part, False) for part in free] + [(part, True) for part in covered]:
            numbers = count + np.arange(len(polygon))
            count += len(polygon)
            corners.append(np.broadcast_to(facets[facet], (len(polygon), facets.shape[1])))
            shares.append(polygon)
            simplices = _fan(numbers, polygon @ x[facets[facet]])
            kept.append(simplices)
            parents.append(np.full(len(simplices), facet))
            more_tied += [on_it] * len(simplices)
    if not divided.any():
        return DividedFacets(facets, parents[0], tied, None)
    keep = np.concatenate([~divided, np.ones(len(more_tied), dtype=bool)])
    numbers, of = np.concatenate(corners), np.concatenate(shares)
    vertex, new = _once(x, facets[divided], np.einsum("vc,vcd->vd", of, x[numbers]))
    found = vertex[np.concatenate(kept)[keep]]
    solid = np.array([len(set(simplex)) == len(simplex) for simplex in found.tolist()])
    rows = np.concatenate([np.arange(len(x)), np.repeat(len(x) + np.arange(len(new)), facets.shape[1])])
    columns = np.concatenate([np.arange(len(x)), numbers[new].ravel()])
    values = np.concatenate([np.ones(len(x)), of[new].ravel()])
    mixture = sparse_from_entries(rows, columns, values, (len(x) + len(new), len(x)))
    found, parent = found[solid], np.concatenate(parents)[keep][solid]
    is_tied = np.concatenate([tied, more_tied]).astype(bool)[keep][solid]
    if x.shape[1] == 3:
        near = 10.0 * NO_LENGTH * float(_edges(x[facets[divided]]).max())
        found, of_found = conforming(mixture @ x, found, near)
        parent, is_tied = parent[of_found], is_tied[of_found]
    return DividedFacets(found, parent, is_tied, mixture)


def _edges(corners: Array) -> Array:
    """Lengths of the edges of facets, shape (facets, dim)."""
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2))


def _once(x: Array, facets: Indices, more: Array) -> tuple[Indices, Indices]:
    """(new number of each vertex, which of the additional ones are kept), with one vertex in each place.

    x, more: positions of vertices and of additional ones [m]; facets: those whose parts have the additional ones.
    """
    size = float(_edges(x[facets]).min())
    corners = np.unique(facets)
    at = np.concatenate([corners, len(x) + np.arange(len(more))])
    pairs = cKDTree(np.concatenate([x[corners], more])).query_pairs(10.0 * NO_LENGTH * size, output_type="ndarray")
    part = connected_parts(pairs[:, 0], pairs[:, 1], len(at))
    _, first = np.unique(part, return_index=True)
    vertex = np.arange(len(x) + len(more))
    vertex[at] = at[first][np.searchsorted(np.unique(part), part)]
    new = np.unique(vertex[len(x) :])
    new = new[new >= len(x)]
    number = np.arange(len(vertex))
    number[new] = len(x) + np.arange(len(new))
    return number[vertex], new - len(x)


def _fan(numbers: Indices, x: Array) -> Indices:
    """Segments or triangles of a convex part with these vertices at x [m], the same ones on both sides of a tie."""
    if x.shape[1] == 2:
        return numbers[None]
    numbers = np.roll(numbers, -int(np.lexsort(x.round(int(8 - np.log10(np.ptp(x)))).T)[0]))
    return np.stack([np.full(len(numbers) - 2, numbers[0]), numbers[1:-1], numbers[2:]], axis=1)


def _size(parts: Sequence[Array]) -> float:
    """Share of a facet that convex parts of it take."""
    dim = parts[0].shape[1]
    if dim == 2:
        return float(sum(np.ptp(part[:, 1]) for part in parts))
    triangles = [part[[0, k, k + 1]] for part in parts for k in range(1, len(part) - 1)]
    return float(sum(abs(np.linalg.det(triangle)) for triangle in triangles))


def _divide(corners: Array, others: Array) -> tuple[list[Array], list[Array]]:
    """(free parts, parts under other facets) of a facet, each as shares of its corners, shape (vertices, dim)."""
    dim = len(corners)
    size = float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max())
    margin = ON_IT * size
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    near = np.all((others.max(axis=1) >= low) & (others.min(axis=1) <= high), axis=1)
    near &= unit_normals(others) @ unit_normals(corners) < OPPOSED
    others = others[near]
    distance = (others - corners[0]) @ unit_normals(corners)
    free, covered = [np.eye(dim)], []
    for other in others[np.abs(distance).max(axis=1, initial=0.0) <= margin]:
        rest = []
        for part in free:
            outside, inside = _clip(part, _shares(corners, other))
            rest += outside
            covered += inside
        free = rest
    return free, covered


def _shares(corners: Array, points: Array) -> Array:
    """Points projected on a facet as shares of its corners, shape (n, dim)."""
    along = (corners[1:] - corners[0]).T
    found = np.linalg.lstsq(along, (points - corners[0]).T, rcond=None)[0].T
    return np.column_stack([1.0 - found.sum(axis=1), found])


def _clip(part: Array, other: Array) -> tuple[list[Array], list[Array]]:
    """(parts outside of another facet, parts inside of it) of a convex part; all as shares of the facet's corners."""
    outside: list[Array] = []
    for inward in _sides(other):
        beyond, part = _split(part, inward)
        outside += [beyond] if len(beyond) else []
        if not len(part):
            return outside, []
    return outside, [part]


def _sides(other: Array) -> list[Array]:
    """For each side of a facet, distance from it as a linear form of shares, positive inside."""
    if len(other) == 2:
        (a, b) = sorted(other[:, 1])
        return [np.array([-a, 1.0 - a]), np.array([b, b - 1.0])]
    if np.linalg.det(other) < 0.0:
        other = other[::-1]
    forms = [np.cross(other[k], other[(k + 1) % 3]) for k in range(3)]
    lengths = [np.linalg.norm(other[(k + 1) % 3] - other[k]) for k in range(3)]
    return [form / length for form, length in zip(forms, lengths, strict=True) if length > 0.0]


def _split(part: Array, inward: Array) -> tuple[Array, Array]:
    """(part with negative distance, part with positive distance) of a convex part, empty if without extent."""
    distance = part @ inward
    distance[np.abs(distance) < NO_LENGTH] = 0.0
    if (distance >= 0.0).all():
        return part[:0], part
    if (distance <= 0.0).all():
        return part, part[:0]
    if part.shape[1] == 2:
        (a, b), (first, last) = distance, part
        middle = (first * b - last * a) / (b - a)
        ends = np.stack([first, middle]), np.stack([middle, last])
        return ends if a < 0.0 else ends[::-1]
    negative, positive = [], []
    for x, a, y, b in zip(part, distance, np.roll(part, -1, axis=0), np.roll(distance, -1), strict=True):
        negative += [x] if a <= 0.0 else []
        positive += [x] if a >= 0.0 else []
        if a * b < 0.0:
            middle = (x * b - y * a) / (b - a)
            negative.append(middle)
            positive.append(middle)
    return np.array(negative), np.array(positive)
