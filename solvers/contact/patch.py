"""Slave patches, which are connected slave surfaces, and their multipliers, one per node and side of a sharp edge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, sparse
from solvers.api import Array
from solvers.contact.law.law import Law
from solvers.contact.sharp_edges import split_nodes
from solvers.contact.surface import ContactNodes, Surface, facet_areas
from solvers.kernels import basis_transformation, nodal_normals
from solvers.mesh.cell_types import CELL_TYPES


@dataclass(frozen=True)
class SlavePatch:
    """Connected slave surfaces; nodes on sharp edges are split (see `split_nodes`)."""

    nodes: NDArray[np.int64]  #: of each split node, among all nodes, shape (n,)
    multipliers: NDArray[np.int64]  #: among all multipliers, shape (n,)
    facets: NDArray[np.int64]  #: of all its surfaces, in numbers of the split nodes
    facet_type: str
    areas: Array  #: reference area around each node [m^(dim-1)], shape (n,)
    mask: Array | None  #: 0 for components that a plane of symmetry forbids, 1 for others, shape (n, dim)

    def normals(self, x: Array, near: NDArray[np.bool_] | None = None) -> tuple[Array, Sparse]:
        """Averaged unit normals at positions x [m] of its nodes, and their derivatives (dim * n, dim * n).

        near: mask of the nodes whose derivatives are computed, (n,); None: of all. Those of others are zero.
        """
        x, chosen = np.ascontiguousarray(x), None if near is None else near.astype(np.uint8)
        kernel = CELL_TYPES[self.facet_type].kernel
        found, slopes = nodal_normals(x, self.facets, kernel, self.mask, chosen=chosen)
        return found, sparse(slopes, (x.size, x.size))

    def basis(self) -> tuple[Sparse, Sparse]:
        """T of the basis N~ = N T that multipliers are dual to, and its inverse; the identity except for tri6."""
        n = len(self.nodes)
        return tuple(  # type: ignore[return-value]
            sparse(csr, (n, n)) for csr in basis_transformation(self.facets, CELL_TYPES[self.facet_type].kernel, n)
        )


@dataclass(frozen=True)
class Multipliers:
    """All multipliers: one for each split node of a slave patch.

    The first N multipliers belong to the N nodes, and most of them are not used. The others belong to split nodes.
    """

    node: NDArray[np.int64]  #: of each multiplier, shape (C,)
    areas: Array  #: reference area around the node in the patch [m^(dim-1)], zero if there is none, shape (C,)
    patches: tuple[SlavePatch, ...]
    patch_of_surface: tuple[int, ...]  #: patch of each slave surface
    facets_of_surface: tuple[NDArray[np.int64], ...]  #: of each slave surface, in numbers of its patch

    @property
    def only_one(self) -> NDArray[np.bool_]:
        """Mask of the multipliers that are the only ones of their nodes, shape (C,)."""
        return np.bincount(self.node[self.areas > 0.0], minlength=len(self.node))[self.node] <= 1


def number_multipliers(
    slaves: Sequence[Surface], numbers: Sequence[NDArray[np.int64]], nodes: ContactNodes, laws: Sequence[Law]
) -> Multipliers:
    """Join slave surfaces with common nodes and the same law to patches, and number the multipliers.

    numbers: of the nodes of each surface; laws: of each surface.
    """
    node = list(range(len(nodes.points)))
    areas = [0.0] * len(node)
    patches: list[SlavePatch] = []
    of_surface = [0] * len(slaves)
    facets_of_surface = [np.empty((0, 0), dtype=np.int64)] * len(slaves)
    for group in _join(slaves, numbers, laws):
        facets, number, owner = _facets([slaves[i] for i in group], [numbers[i] for i in group])
        facet_type = slaves[group[0]].facet_type
        # multipliers of tied surfaces have no normal: there only edges between different surfaces are sharp
        split = split_nodes(nodes.points, facets, facet_type, owner if laws[group[0]].span == "space" else None)
        share = np.zeros(len(split.nodes))
        np.add.at(share, split.facets, facet_areas(nodes.points, facets, facet_type)[:, None] / facets.shape[1])
        multipliers = np.empty(len(split.nodes), dtype=np.int64)
        for k, (at, area) in enumerate(zip(split.nodes.tolist(), share.tolist(), strict=True)):
            if areas[at] > 0.0:
                multipliers[k] = len(node)
                node.append(at)
                areas.append(area)
            else:
                multipliers[k] = at
                areas[at] = area
        mask = _mask([slaves[i] for i in group], [numbers[i] for i in group], nodes)[split.nodes]
        for i, own in zip(group, number, strict=True):
            of_surface[i], facets_of_surface[i] = len(patches), split.facets[own]
        mine = split.nodes, multipliers, split.facets, facet_type, share
        patches.append(SlavePatch(*mine, None if mask.all() else mask))
    return Multipliers(np.array(node), np.array(areas), tuple(patches), tuple(of_surface), tuple(facets_of_surface))


def _join(slaves: Sequence[Surface], numbers: Sequence[NDArray[np.int64]], laws: Sequence[Law]) -> list[list[int]]:
    """Groups of surfaces that share nodes."""
    group = list(range(len(slaves)))
    for i in range(len(slaves)):
        for j in range(i):
            alike = laws[i] == laws[j] and slaves[i].facet_type == slaves[j].facet_type
            if alike and len(np.intersect1d(numbers[i], numbers[j])):
                group = [group[j] if g == group[i] else g for g in group]
    return [[i for i, g in enumerate(group) if g == first] for first in sorted(set(group))]


def _facets(
    surfaces: Sequence[Surface], numbers: Sequence[NDArray[np.int64]]
) -> tuple[NDArray[np.int64], list[NDArray[np.int64]], NDArray[np.int64]]:
    """(facets of all surfaces, each once; numbers of the facets of each surface; first surface of each facet)."""
    every = np.concatenate([own[surface.facets] for surface, own in zip(surfaces, numbers, strict=True)])
    owner = np.arange(len(surfaces)).repeat([len(surface.facets) for surface in surfaces])
    _, first, number = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    ends = np.cumsum([len(surface.facets) for surface in surfaces])[:-1]
    return every[first[order]], np.split(rank[number.ravel()], ends), owner[first[order]]


def _mask(surfaces: Sequence[Surface], numbers: Sequence[NDArray[np.int64]], nodes: ContactNodes) -> Array:
    mask = np.ones(nodes.points.shape)
    for surface, own in zip(surfaces, numbers, strict=True):
        if surface.symmetric is not None:
            mask[own] = np.where(surface.symmetric, 0.0, mask[own])
    return mask
