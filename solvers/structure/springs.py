"""Elastic springs between a body and fixed points: int_G k d.u d.v dA on surfaces, or k d.u d.v at nodes.

They are linear in the displacement for every material: force and stiffness refer to the reference configuration.
Without a direction d, a spring resists all components equally.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.structure.meshed import MeshedBody
from solvers.structure.supports import Where, owned_blocks
from solvers.values import Value, evaluate


@dataclass(frozen=True)
class Spring:
    """Stiffness [N/m^3] on a named surface, [N/m] at each of the nodes."""

    where: Where
    stiffness: Value
    direction: Sequence[float] | None = None  #: direction d; None: all components
    normal: bool = False  #: d is the normal of the surface


class Springs:
    """All springs of a body as one matrix."""

    def __init__(self, body: MeshedBody):
        self.matrix = body.create_tangent()
        for spring in body.springs:
            if isinstance(spring.where, str):
                self._add_surface(body, spring, spring.where)
            else:
                self._add_nodes(body, spring)
        self.matrix.assemble()
        self._u, self._force = self.matrix.createVecs()

    def force(self, u: Array) -> Array:
        """Force K u [N] of the body on the springs, at owned dofs (collective)."""
        self._u.array[:] = u
        self.matrix.mult(self._u, self._force)
        return self._force.array.copy()

    def energy(self, u: Array, comm) -> float:
        """u.K u / 2 [J] (collective)."""
        return 0.5 * comm.allreduce(float(u @ self.force(u)))

    def _add_surface(self, body: MeshedBody, spring: Spring, surface: str) -> None:
        x = np.ascontiguousarray(body.points[: body.dim].T)
        degree = 2 * body.domain.degree + 1
        for facets in fem.facet_quadrature(body.domain, body.space, surface, degree):
            normals = facets.area_vectors(x)
            normals /= np.linalg.norm(normals, axis=2, keepdims=True)
            tensor = _tensor(spring, normals)
            weights = facets.weights * evaluate(spring.stiffness, facets.positions, 0.0).reshape(facets.weights.shape)
            block = np.einsum("ep,pa,pb,epij->eaibj", weights, facets.shape, facets.shape, tensor, optimize=True)
            self._add(body, facets.blocks, block)

    def _add_nodes(self, body: MeshedBody, spring: Spring) -> None:
        blocks = owned_blocks(body, spring.where)
        stiffness = evaluate(spring.stiffness, body.points[:, blocks], 0.0)
        tensor = _tensor(spring, np.zeros((len(blocks), body.dim)))
        self._add(body, blocks[:, None], (stiffness[:, None, None] * tensor)[:, None, :, None, :])

    def _add(self, body: MeshedBody, blocks, values: Array) -> None:
        """Add matrices (entities, nodes, dim, nodes, dim) at the dofs of (entities, nodes)."""
        size = body.dim * blocks.shape[1]
        dofs = body.dim * blocks[:, :, None] + np.arange(body.dim, dtype=np.int32)
        rows = dofs.reshape(len(blocks), size).astype(PETSc.IntType)
        if len(blocks):  # petsc4py divides by it
            self.matrix.setValuesLocalRCV(rows, rows, values.reshape(len(blocks), size, size), addv=True)


def _tensor(spring: Spring, normals: Array) -> Array:
    """d d^T, or the identity, at points with these normals, shape (..., dim, dim)."""
    dim = normals.shape[-1]
    if spring.normal:
        return normals[..., :, None] * normals[..., None, :]
    if spring.direction is None:
        return np.broadcast_to(np.eye(dim), (*normals.shape, dim))
    direction = np.array(spring.direction) / np.linalg.norm(spring.direction)
    return np.broadcast_to(np.outer(direction, direction), (*normals.shape, dim))
