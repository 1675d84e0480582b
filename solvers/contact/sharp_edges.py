"""Splitting of surfaces at sharp edges: a node on an edge becomes one node per side, each with its own normal.

Two facets at a node are on the same side if a path between them around the node crosses no sharp edge. Hence an edge
may end within a surface, and its last node is not split.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices
from solvers.kernels import nodal_normals
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.tessellation import SHARP


@dataclass(frozen=True)
class SplitNodes:
    """Nodes of a surface, with one node per side on sharp edges, in the order of the original nodes."""

    nodes: Indices  #: the original node of each, shape (n,)
    facets: Indices  #: facets in numbers of the split nodes, shape (k, nodes per facet)


def split_nodes(points: Array, facets: Indices, facet_type: str, among: Indices | None = None) -> SplitNodes:
    """Split the nodes of facets (k, nodes per facet) at sharp edges; points: reference positions [m], (n, dim).

    among: a number per facet, (k,); edges between facets with equal numbers are not sharp.
    """
    k, n = facets.shape
    of_facet, ends, normals = np.arange(k).repeat(n), facets.ravel(), _corner_normals(points, facets, facet_type)
    i, j = _across_edges(facets, facet_type)
    smooth = np.einsum("ed,ed->e", normals[i], normals[j]) > np.cos(SHARP)
    if among is not None:
        smooth |= among[of_facet[i]] == among[of_facet[j]]
    part = connected_parts(i[smooth], j[smooth], k * n)
    split, number = np.unique(np.stack([ends, part], axis=1), axis=0, return_inverse=True)
    return SplitNodes(split[:, 0], number.reshape(k, n).astype(np.int64))


def rims(facets: Indices, facet_type: str) -> Indices:
    """The nodes of each edge (2D: end) that only one of the facets (k, nodes per facet) has, shape (e, 1 to 3)."""
    kind = CELL_TYPES[facet_type]
    local = [[i for i, group in enumerate(kind.nodes) if set(group) <= set(edge)] for edge in _edges(kind.corners)]
    edges = np.concatenate([facets[:, own] for own in local])
    _, number, count = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    return edges[count[number.ravel()] == 1]


def _edges(corners: int) -> list[tuple[int, ...]]:
    """The corners of each edge of a facet (2D: end)."""
    return [(0,), (1,)] if corners == 2 else [(c, (c + 1) % corners) for c in range(corners)]


def _corner_normals(points: Array, facets: Indices, facet_type: str) -> Array:
    """Unit normals of every facet at each of its nodes, shape (k * nodes per facet, dim)."""
    alone = np.arange(facets.size).reshape(facets.shape)
    x = np.ascontiguousarray(points[facets.ravel()])
    return nodal_normals(x, alone, CELL_TYPES[facet_type].kernel, None, derivatives=False)[0]


def _across_edges(facets: Indices, facet_type: str) -> tuple[Indices, Indices]:
    """Pairs of local nodes, facet * nodes per facet + number, that are the same node of a common edge (2D: end)."""
    k, n = facets.shape
    keys, nodes, entries = [], [], []
    for edge in _edges(CELL_TYPES[facet_type].corners):
        for local, group in enumerate(CELL_TYPES[facet_type].nodes):
            if set(group) <= set(edge):
                keys.append(np.sort(facets[:, edge], axis=1))
                nodes.append(facets[:, local])
                entries.append(np.arange(k) * n + local)
    rows = np.column_stack([np.concatenate(keys), np.concatenate(nodes)])
    entry, order = np.concatenate(entries), np.lexsort(rows.T)
    same = (rows[order][1:] == rows[order][:-1]).all(axis=1)
    return entry[order][:-1][same], entry[order][1:][same]
