"""Slave patches: surfaces with one field of normals, and the multipliers at their nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.cell_types import CELL_TYPES
from solvers.contact.surface import Nodes, Surface, nodal_areas
from solvers.kernels import basis_transformation, nodal_normals
from solvers.sparse import Sparse, sparse

#: Slave surfaces with common nodes are one patch if their normals there have a product above this (45 degrees).
SMOOTH = np.sqrt(0.5)


@dataclass(frozen=True)
class Patch:
    """A slave surface, or several that continue each other smoothly."""

    nodes: NDArray[np.int64]  #: among all nodes, shape (n,)
    multipliers: NDArray[np.int64]  #: among all multipliers, shape (n,)
    facets: NDArray[np.int64]  #: of all its surfaces, in numbers of the patch
    facet_type: str
    areas: Array  #: reference area around each node [m^(dim-1)], shape (n,)
    mask: Array | None  #: 0 for components that a plane of symmetry forbids, 1 for others, shape (n, dim)

    def normals(self, x: Array) -> tuple[Array, Sparse]:
        """Averaged unit normals at positions x [m] of its nodes, and their derivatives (dim * n, dim * n)."""
        x = np.ascontiguousarray(x)
        found, slopes = nodal_normals(x, self.facets, CELL_TYPES[self.facet_type].kernel, self.mask)
        return found, sparse(slopes, (x.size, x.size))

    def basis(self) -> tuple[Sparse, Sparse]:
        """T with N~ = N T, the basis that multipliers are dual to, and its inverse; the identity but for tri6."""
        n = len(self.nodes)
        return tuple(  # type: ignore[return-value]
            sparse(csr, (n, n)) for csr in basis_transformation(self.facets, self._kernel_type, n)
        )

    @property
    def _kernel_type(self) -> str:
        return CELL_TYPES[self.facet_type].kernel


@dataclass(frozen=True)
class Multipliers:
    """All multipliers: one for each node and slave patch.

    The first N belong to the N nodes (most of which have none in use), the others to nodes of several patches.
    """

    node: NDArray[np.int64]  #: of each multiplier, shape (C,)
    areas: Array  #: reference area around the node in the patch [m^(dim-1)], zero if there is none, shape (C,)
    patches: tuple[Patch, ...]
    patch_of_surface: tuple[int, ...]  #: patch of each slave surface

    @property
    def alone(self) -> NDArray[np.bool_]:
        """Multipliers that share their node with no other one, shape (C,)."""
        return np.bincount(self.node[self.areas > 0.0], minlength=len(self.node))[self.node] <= 1


def number_multipliers(
    slaves: Sequence[Surface], numbers: Sequence[NDArray[np.int64]], nodes: Nodes, kinds: Sequence[object]
) -> Multipliers:
    """Join slave surfaces to patches where they are smooth and of one kind, and number the multipliers.

    numbers: of the nodes of each surface; kinds: what surfaces must agree in to be joined.
    """
    size = len(nodes.points)
    members = _join(slaves, numbers, kinds)
    node = list(range(size))
    areas = [0.0] * size
    patches = []
    for group in members:
        patch_nodes = np.unique(np.concatenate([numbers[i] for i in group]))
        at = [np.searchsorted(patch_nodes, numbers[i]) for i in group]
        share = np.zeros(len(patch_nodes))
        for i, places in zip(group, at, strict=True):
            share[places] += nodal_areas(slaves[i])
        multipliers = np.empty(len(patch_nodes), dtype=np.int64)
        for k, (number, area) in enumerate(zip(patch_nodes.tolist(), share.tolist(), strict=True)):
            if areas[number] > 0.0:
                multipliers[k] = len(node)
                node.append(number)
                areas.append(area)
            else:
                multipliers[k] = number
                areas[number] = area
        facets = np.concatenate([places[slaves[i].facets] for i, places in zip(group, at, strict=True)])
        facets = facets[np.sort(np.unique(np.sort(facets, axis=1), axis=0, return_index=True)[1])]
        mask = _mask([slaves[i] for i in group], at, (len(patch_nodes), nodes.dim))
        patches.append(Patch(patch_nodes, multipliers, facets, slaves[group[0]].facet_type, share, mask))
    of_surface = [next(k for k, group in enumerate(members) if i in group) for i in range(len(slaves))]
    return Multipliers(np.array(node), np.array(areas), tuple(patches), tuple(of_surface))


def _join(slaves: Sequence[Surface], numbers: Sequence[NDArray[np.int64]], kinds: Sequence[object]) -> list[list[int]]:
    """Groups of surfaces that share nodes, all of them with nearly the same normals."""
    group = list(range(len(slaves)))
    for i in range(len(slaves)):
        for j in range(i):
            common, at_i, at_j = np.intersect1d(numbers[i], numbers[j], return_indices=True)
            if len(common) == 0 or kinds[i] != kinds[j] or slaves[i].facet_type != slaves[j].facet_type:
                continue
            products = np.einsum("nd,nd->n", _reference_normals(slaves[i])[at_i], _reference_normals(slaves[j])[at_j])
            if (products > SMOOTH).all():
                group = [group[j] if g == group[i] else g for g in group]
    return [[i for i, g in enumerate(group) if g == first] for first in sorted(set(group))]


def _reference_normals(surface: Surface) -> Array:
    facets = np.ascontiguousarray(surface.facets, dtype=np.int64)
    return nodal_normals(surface.points, facets, CELL_TYPES[surface.facet_type].kernel, None, derivatives=False)[0]


def _mask(surfaces: Sequence[Surface], at: Sequence[NDArray[np.int64]], shape: tuple[int, int]) -> Array | None:
    mask = np.ones(shape)
    for surface, places in zip(surfaces, at, strict=True):
        if surface.symmetric is not None:
            mask[places] = np.where(surface.symmetric, 0.0, mask[places])
    return None if mask.all() else mask
