"""Supports of a body: prescribed displacement components, along axes (dofs) or along an oblique direction.

At a node with an oblique direction all conditions n_j.u = g_j are made orthonormal from the last support to the first
(Gram-Schmidt): they prescribe P u with the projection P on the span of the n_j. Where supports contradict each other,
the last one applies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.structure.meshed import MeshedBody
from solvers.values import Value, evaluate

#: A named surface, or nodes by their numbers in the mesh.
Where = str | NDArray[np.int64]

#: Sine of the angle between two directions at a node below which they are parallel.
PARALLEL = 1e-6


@dataclass(frozen=True)
class Support:
    """Prescribed displacement components [m]; None leaves a component free. A single number applies to all."""

    where: Where
    displacement: float | Sequence[Value | None] = 0.0

    def components(self, dim: int) -> Sequence[Value | None]:
        return (self.displacement,) * dim if isinstance(self.displacement, (int, float)) else self.displacement


@dataclass(frozen=True)
class Symmetry:
    """No displacement normal to a plane surface."""

    where: str


@dataclass(frozen=True)
class Roller:
    """Prescribed displacement [m] along one direction, in the reference configuration; free across it."""

    where: Where
    direction: Sequence[float] | None = None  #: None: the outward normal of the surface, node by node
    displacement: Value = 0.0


class SupportError(ValueError):
    """A support that cannot be applied; where: its surface or nodes."""

    def __init__(self, body: str, where: Where, message: str):
        place = f"surface '{where}'" if isinstance(where, str) else "nodes"
        super().__init__(f"body '{body}', {place}: {message}")
        self.body, self.where, self.message = body, where, message


@dataclass(frozen=True)
class Share:
    """Condition of one support at oblique nodes, h.u = (g - along.targets) / size, with a new direction h."""

    nodes: NDArray[np.int64]  #: numbers among the oblique nodes, shape (m,)
    slots: NDArray[np.int64]  #: number of the new direction at its node, shape (m,)
    along: Array  #: components of the support's direction along earlier directions of the node, shape (m, dim)
    sizes: Array  #: length of its part orthogonal to these, shape (m,)
    value: Value  #: g [m]
    points: Array  #: positions at which g is evaluated [m], shape (3, m)


@dataclass(frozen=True)
class Oblique:
    """Conditions at owned nodes of a body with an oblique direction."""

    blocks: NDArray[np.int32]  #: local, sorted, shape (k,)
    basis: Array  #: prescribed directions, orthonormal or zero, shape (k, dim, dim)
    shares: tuple[Share, ...]

    @property
    def projections(self) -> Array:
        """P, projections on the prescribed directions, shape (k, dim, dim)."""
        return np.einsum("kij,kil->kjl", self.basis, self.basis)

    def displacement(self, t: float) -> Array:
        """P u [m] at the time t [s], shape (k, dim)."""
        targets = np.zeros(self.basis.shape[:2])
        for share in self.shares:
            already = np.einsum("md,md->m", share.along, targets[share.nodes])
            targets[share.nodes, share.slots] = (evaluate(share.value, share.points, t) - already) / share.sizes
        return np.einsum("kij,ki->kj", self.basis, targets)


@dataclass(frozen=True)
class Prescribed:
    """Prescribed displacements at the owned nodes of a body."""

    dofs: NDArray[np.int32]  #: prescribed local dofs, sorted, shape (n,)
    entries: tuple[tuple[NDArray[np.int32], Value, Array], ...]  #: dofs, displacement [m], points [m] (3, m)
    oblique: Oblique

    def displacement(self, t: float) -> Array:
        """Values [m] of `dofs` at the time t [s], shape (n,). Where supports overlap, the last one applies."""
        values = np.zeros(len(self.dofs))
        for dofs, value, points in self.entries:
            values[np.searchsorted(self.dofs, dofs)] = evaluate(value, points, t)
        return values


@dataclass(frozen=True)
class _Condition:
    """n.u = g at some owned nodes."""

    blocks: NDArray[np.int32]
    axis: int | None  #: number of the axis along n; None: n is oblique
    directions: Array  #: n, shape (m, dim)
    value: Value


def prescribe(body: MeshedBody) -> Prescribed:
    """Collect the supports of a body (collective). Raises SupportError."""
    conditions = [condition for support in body.supports for condition in _conditions(body, support)]
    turned = [c.blocks for c in conditions if c.axis is None]
    oblique = np.unique(np.concatenate([np.empty(0, dtype=np.int32), *turned])).astype(np.int32)
    entries = []
    for condition in conditions:
        blocks = condition.blocks[~np.isin(condition.blocks, oblique)]
        if condition.axis is not None:
            entries.append((blocks * body.dim + condition.axis, condition.value, body.points[:, blocks]))
    dofs = np.unique(np.concatenate([np.empty(0, dtype=np.int32), *(e[0] for e in entries)]))
    return Prescribed(dofs.astype(np.int32), tuple(entries), _orthonormal(body, conditions, oblique))


def symmetric_dofs(body: MeshedBody) -> NDArray[np.int32]:
    """Owned local dofs that are held by planes of symmetry normal to an axis (collective). Raises SupportError."""
    found = [np.empty(0, dtype=np.int32)]
    for support in body.supports:
        if isinstance(support, Symmetry):
            blocks = owned_blocks(body, support.where)
            normal = np.abs(symmetry_normal(body, support, blocks))
            if normal.max() == 1.0:
                found.append(blocks * body.dim + int(np.argmax(normal)))
    return np.unique(np.concatenate(found)).astype(np.int32)


def owned_blocks(body: MeshedBody, where: Where) -> NDArray[np.int32]:
    """Owned dof blocks of a body on a named surface, or at given nodes (collective)."""
    if isinstance(where, str):
        blocks = fem.surface_blocks(body.domain, body.space, where)
        return np.unique(blocks[blocks < body.owned]).astype(np.int32)
    return np.flatnonzero(np.isin(body.nodes[: body.owned], where)).astype(np.int32)


def _conditions(body: MeshedBody, support: Support | Symmetry | Roller) -> list[_Condition]:
    blocks = owned_blocks(body, support.where)
    axes = np.eye(body.dim)

    def along(direction: Array, value: Value) -> _Condition:
        axis = next((i for i in range(body.dim) if np.array_equal(np.abs(direction), axes[i])), None)
        if axis is not None and direction[axis] < 0.0:
            return _Condition(
                blocks, axis, np.broadcast_to(-direction, (len(blocks), body.dim)), lambda x, t: -evaluate(value, x, t)
            )
        return _Condition(blocks, axis, np.broadcast_to(direction, (len(blocks), body.dim)), value)

    if isinstance(support, Support):
        return [along(axes[i], value) for i, value in enumerate(support.components(body.dim)) if value is not None]
    if isinstance(support, Symmetry):
        return [along(symmetry_normal(body, support, blocks), 0.0)]
    if support.direction is not None:
        direction = np.array(support.direction)
        return [along(direction / np.linalg.norm(direction), support.displacement)]
    assert isinstance(support.where, str), "nodes have no normal"
    normals = _nodal_normals(body, support.where)[blocks]
    mean = body.domain.comm.allreduce(normals.sum(axis=0))
    nearest = np.sign(mean[np.argmax(np.abs(mean))]) * axes[np.argmax(np.abs(mean))]
    if body.domain.comm.allreduce(bool(np.all(np.abs(normals - nearest) < 1e-9)), op=MPI.LAND):
        return [along(nearest, support.displacement)]
    return [_Condition(blocks, None, normals, support.displacement)]


def _orthonormal(body: MeshedBody, conditions: list[_Condition], oblique: NDArray[np.int32]) -> Oblique:
    """The conditions at nodes with an oblique direction, made orthonormal."""
    basis = np.zeros((len(oblique), body.dim, body.dim))
    found = np.zeros(len(oblique), dtype=np.int64)
    shares = []
    for condition in reversed(conditions):
        here = np.flatnonzero(np.isin(condition.blocks, oblique))
        nodes, directions = np.searchsorted(oblique, condition.blocks[here]), condition.directions[here]
        along = np.einsum("mij,mj->mi", basis[nodes], directions)
        rest = directions - np.einsum("mi,mij->mj", along, basis[nodes])
        sizes = np.linalg.norm(rest, axis=1)
        new = sizes >= PARALLEL
        nodes, slots = nodes[new], found[nodes[new]]
        basis[nodes, slots] = rest[new] / sizes[new, None]
        found[nodes] += 1
        points = body.points[:, oblique[nodes]]
        shares.append(Share(nodes, slots, along[new], sizes[new], condition.value, points))
    return Oblique(oblique, basis, tuple(shares) if len(oblique) else ())


def symmetry_normal(body: MeshedBody, support: Symmetry, blocks: NDArray[np.int32]) -> Array:
    """Unit normal of a plane of symmetry, exact if it is an axis (collective). Raises SupportError for curved ones."""
    points = body.points[: body.dim, blocks]
    extent = _extent(body, points)
    axis = int(np.argmin(extent))
    if extent[axis] <= 1e-9 * np.max(extent):
        return np.eye(body.dim)[axis]
    area = sum((weighted.sum(axis=(0, 1)) for _, weighted in _normals_by_node(body, support.where)), np.zeros(body.dim))
    normal = body.domain.comm.allreduce(area)
    size = np.linalg.norm(normal)
    if size > 0.0 and _extent(body, (normal / size @ points)[None])[0] <= 1e-9 * np.max(extent):
        return np.asarray(normal / size)
    raise SupportError(
        body.name, support.where, "a plane of symmetry must be plane, but this surface is curved; take 'normal: true'"
    )


def _extent(body: MeshedBody, values: Array) -> Array:
    """Largest minus smallest value of each row over all processes."""
    low, high = values.min(axis=1, initial=np.inf), values.max(axis=1, initial=-np.inf)
    gathered = body.domain.comm.allgather((low, high))
    return np.asarray(np.max([h for _, h in gathered], axis=0) - np.min([low for low, _ in gathered], axis=0))


def _normals_by_node(body: MeshedBody, surface: str) -> list[tuple[NDArray[np.int32], Array]]:
    """Pairs (blocks, int N^2 n dA) by type of facet. N^2, because the mean of N may be zero or negative."""
    x = np.ascontiguousarray(body.points[: body.dim].T)
    found = []
    for facets in fem.facet_quadrature(body.domain, body.space, surface, 2 * body.domain.degree + 1):
        weighted = np.einsum("p,pa,epd->ead", facets.rule, facets.shape**2, facets.area_vectors(x), optimize=True)
        found.append((facets.blocks, weighted))
    return found


def _nodal_normals(body: MeshedBody, surface: str) -> Array:
    """Outward unit normals in the reference configuration at owned nodes, zero off the surface, shape (owned, dim)."""
    total = fem.function(body.space)
    normals = total.x.array.reshape(-1, body.dim)
    for blocks, weighted in _normals_by_node(body, surface):
        np.add.at(normals, blocks, weighted)
    fem.accumulate(total)
    owned = normals[: body.owned]
    size = np.linalg.norm(owned, axis=1, keepdims=True)
    return np.divide(owned, size, out=np.zeros_like(owned), where=size > 0.0)
