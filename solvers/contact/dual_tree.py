"""The search tree of self contact: a binary tree on the facets of one surface, built bottom-up from neighbours.

A piece of surface is not searched in itself if its normals lie in so narrow a cone that no two of them are opposed.
Source: Yang & Laursen, Comput. Mech. 41 (2008), section 3: dual graph, curvature criterion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.search import OPPOSED
from solvers.mesh.tessellation import unit_normals

#: Two normals whose product with a common unit vector exceeds this are not opposed: cos(2 a) = OPPOSED.
CONE = np.sqrt(0.5 * (1.0 + OPPOSED))

#: Count of unit vectors that normals are compared with, by dimension; at most 64, the bits of an integer.
SAMPLED_NORMALS = {2: 32, 3: 64}


@dataclass(frozen=True)
class TreeLevel:
    """Nodes of one depth, with two children each in the next finer level; a single child is given twice."""

    children: Indices  #: shape (n, 2)

    def reduce(self, function: np.ufunc, finer: NDArray) -> NDArray:
        """Values of the nodes from those of their children."""
        return function(finer[self.children[:, 0]], finer[self.children[:, 1]])


class DualTree:
    """Finds the facets of a surface that may touch each other."""

    def __init__(self, facets: Indices, facet_type: str, points: Array):
        """facets (k, nodes per facet) with nodes at the reference positions points [m], shape (n, dim)."""
        self.facets, self._simplices = facets, np.array(CELL_TYPES[facet_type].simplices)
        dim = points.shape[1]
        self._samples, self._directions = _sample_vectors(dim), _directions(dim)
        corners = facets[:, : CELL_TYPES[facet_type].corners]
        self.levels = _join(len(facets), neighbours(corners, dim), points[corners].mean(axis=1))
        self.tests = 0  #: comparisons of two nodes, or of a node with itself, in the latest search

    def normals(self, x: Array) -> Array:
        """Unit normals of the flat pieces of all facets, shape (k, pieces, dim)."""
        return unit_normals(x[self.facets[:, self._simplices]])

    def pairs(self, x: Array, inflation: float, x_previous: Array | None = None) -> Indices:
        """Pairs of facets i < j whose paths from x_previous to x come closer than `inflation` [m], shape (p, 2).

        Some pairs that are slightly farther apart are included. Only opposed facets without a common node are.
        """
        normals = self.normals(x)
        low, high = self.slabs(x, x_previous, 0.5 * inflation)
        bits = 1 << np.arange(len(self._samples), dtype=np.uint64)
        within = (normals @ self._samples.T > CONE).all(axis=1)
        masks = [np.where(within, bits, np.uint64(0)).sum(axis=1, dtype=np.uint64)]
        lows, highs = [low], [high]
        for level in self.levels:
            masks.append(level.reduce(np.bitwise_and, masks[-1]))
            lows.append(level.reduce(np.minimum, lows[-1]))
            highs.append(level.reduce(np.maximum, highs[-1]))
        found = self._descend(masks, lows, highs)
        return found[self.may_touch(found, normals)]

    def may_touch(self, pairs: Indices, normals: Array) -> NDArray[np.bool_]:
        """Mask of the pairs without a common node that are opposed somewhere."""
        nodes = self.facets[pairs]
        apart = ~(nodes[:, 0, :, None] == nodes[:, 1, None, :]).any(axis=(1, 2))
        products = np.einsum("pad,pbd->pab", normals[pairs[:, 0]], normals[pairs[:, 1]])
        return apart & (products < OPPOSED).any(axis=(1, 2))

    def slabs(self, x: Array, x_previous: Array | None, radius: float) -> tuple[Array, Array]:
        """Lowest and highest coordinates of the facets along the directions of the k-DOPs [m], (k, directions)."""
        ends = [x[self.facets] @ self._directions.T]
        if x_previous is not None:
            ends.append(x_previous[self.facets] @ self._directions.T)
        extents = np.concatenate(ends, axis=1)
        return extents.min(axis=1) - radius, extents.max(axis=1) + radius

    def _descend(self, masks: Sequence[NDArray], lows: Sequence[Array], highs: Sequence[Array]) -> Indices:
        """Pairs of facets from the root down, level by level: tests of nodes with themselves and with others."""
        alone, both = np.arange(len(masks[-1])), np.empty((0, 2), dtype=np.int64)
        self.tests = 0
        for depth in range(len(masks) - 1, -1, -1):
            self.tests += len(alone) + len(both)
            alone = alone[masks[depth][alone] == 0]
            a, b = both.T
            meet = (masks[depth][a] & masks[depth][b]) == 0
            meet &= (lows[depth][a] <= highs[depth][b]).all(axis=1) & (lows[depth][b] <= highs[depth][a]).all(axis=1)
            both = both[meet]
            if depth == 0:
                break
            children = self.levels[depth - 1].children
            first, second = children[both[:, 0]], children[both[:, 1]]
            crossed = [np.stack([first[:, i], second[:, j]], axis=1) for i in (0, 1) for j in (0, 1)]
            split = children[alone]
            alone = np.unique(split)
            both = np.unique(np.sort(np.concatenate([*crossed, split[split[:, 0] != split[:, 1]]]), axis=1), axis=0)
        return both


def _sample_vectors(dim: int) -> Array:
    """Uniformly distributed unit vectors, shape (n, dim)."""
    n = SAMPLED_NORMALS[dim]
    if dim == 2:
        angles = 2.0 * np.pi * np.arange(n) / n
        return np.stack([np.cos(angles), np.sin(angles)], axis=1)
    height = 1.0 - (2.0 * np.arange(n) + 1.0) / n  # points of equal area along a spiral on the sphere
    angles = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(n)
    radius = np.sqrt(1.0 - height**2)
    return np.stack([radius * np.cos(angles), radius * np.sin(angles), height], axis=1)


def _directions(dim: int) -> Array:
    """Directions of k-DOPs with 8 (2D) or 18 (3D) sides, shape (directions, dim)."""
    axes = np.eye(dim)
    found = [*axes]
    for i in range(dim):
        for j in range(i):
            found += [(axes[i] + axes[j]) / np.sqrt(2.0), (axes[i] - axes[j]) / np.sqrt(2.0)]
    return np.array(found)


def neighbours(corners: Indices, dim: int) -> Indices:
    """Facets with a common edge (2D: node), the dual graph, shape (e, 2)."""
    k, n = corners.shape
    if dim == 2:
        edges = corners.reshape(-1, 1)
    else:
        edges = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(k), n)
    order = np.lexsort(edges.T)
    edges, owner = edges[order], owner[order]
    same = (edges[1:] == edges[:-1]).all(axis=1)
    return np.stack([owner[:-1][same], owner[1:][same]], axis=1)


def _join(count: int, edges: Indices, middles: Array) -> list[TreeLevel]:
    """Levels from the facets to the root: pairs of neighbours become one node, the nearest first."""
    levels: list[TreeLevel] = []
    weights: Array = np.ones(count)
    while count > 1:
        cost = np.linalg.norm(middles[edges[:, 0]] - middles[edges[:, 1]], axis=1)
        parent = np.full(count, -1)
        children: list[tuple[int, int]] = []
        for a, b in edges[np.argsort(cost, kind="stable")].tolist():
            if parent[a] < 0 and parent[b] < 0:
                parent[a] = parent[b] = len(children)
                children.append((a, b))
        rest = np.flatnonzero(parent < 0).tolist()
        if not children:  # disconnected pieces
            children = list(zip(rest[::2], rest[1::2], strict=False))
            rest = rest[len(rest) // 2 * 2 :]
        children += [(a, a) for a in rest]
        level = TreeLevel(np.array(children, dtype=np.int64))
        for number, both in enumerate(children):
            parent[list(both)] = number
        total = np.asarray(np.bincount(parent, weights, len(children)), dtype=float)
        sums = [np.bincount(parent, weights * component, len(children)) for component in middles.T]
        middles = np.stack(sums, axis=1) / total[:, None]
        weights, count = total, len(level.children)
        joined = np.unique(np.sort(parent[edges], axis=1), axis=0)
        edges = joined[joined[:, 0] != joined[:, 1]]
        levels.append(level)
    return levels
