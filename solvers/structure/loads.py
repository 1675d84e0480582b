"""External forces on a body, by the values of the loads at quadrature points.

    f_ext . v = int (b + rho g).v dX + int_G t.v dA - int_G p n.v da

The pressure p is a follower load: n da = J F^-T N dA is the cross product of the tangents of the deformed facet, in 2D
the tangent rotated by 90 degrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.values import Value, evaluate, evaluate_components

#: Degree in x of loads that are integrated exactly, times the shape functions, over affine cells and facets.
LOAD_DEGREE = 3


@dataclass(frozen=True)
class Traction:
    """Dead load [N/m^2 of reference surface]."""

    surface: str
    value: Sequence[Value]


@dataclass(frozen=True)
class Pressure:
    """Follower pressure [Pa], positive against the surface."""

    surface: str
    value: Value


@dataclass(frozen=True)
class PointForce:
    """Dead load [N] at each of some nodes, which are given by their numbers in the mesh."""

    nodes: NDArray[np.int64]
    value: Sequence[Value]


@dataclass(frozen=True)
class LineForce:
    """Dead load [N/m of reference length] on lines of a mesh in space."""

    lines: NDArray[np.int64]  #: nodes of each line in the mesh: both ends, then the middle if there is one
    points: Array  #: their reference positions [m], shape (lines, nodes, dim)
    value: Sequence[Value]


@dataclass(frozen=True)
class _Part:
    """One load at quadrature points, with the shape functions and weights that give its nodal forces."""

    value: Sequence[Value]
    blocks: NDArray[
        np.int32
    ]  #: dof blocks, shape (entities, nodes); nodes of other processes have the one after the last
    shape: Array  #: shape functions at the points, shape (points, nodes)
    positions: Array  #: [m], shape (3, entities * points)
    weights: Array  #: quadrature weights, for gravity times the density, shape (entities, points)


class DeadLoads:
    """Loads in the reference configuration, which do not depend on the deformation."""

    def __init__(self, domain: fem.Domain, space, owned: NDArray[np.int64]):
        """`owned`: numbers in the mesh of the owned nodes."""
        self._domain, self._space, self._owned = domain, space, owned
        self._blocks = fem.block_points(space).shape[1]
        self._degree = domain.degree + LOAD_DEGREE
        self._parts: list[_Part] = []
        self._values: list[Array] | None = None
        self.force = np.zeros(self._blocks * domain.dim)  #: at the time of `update` [N]

    def add_volume(self, value: Sequence[Value], density: Value = 1.0) -> None:
        """Add a force per mass with the density [kg/m^3] of cell midpoints, or a force per volume without density."""
        for cells in fem.cell_quadrature(self._domain, self._space, self._degree):
            rho: Any = density
            if callable(rho):
                rho = rho(fem.cell_midpoints(self._domain), 0.0)[cells.cells][:, None]
            self._parts.append(_Part(value, cells.blocks, cells.shape, cells.positions, cells.weights * rho))

    def add_surface(self, load: Traction) -> None:
        """Add a force per area of a named surface."""
        for facets in fem.facet_quadrature(self._domain, self._space, load.surface, self._degree):
            self._parts.append(_Part(load.value, facets.blocks, facets.shape, facets.positions, facets.weights))

    def add_lines(self, load: LineForce) -> None:
        """Add a force per length. Every process integrates all lines and keeps the forces on its nodes."""
        xi, rule = np.polynomial.legendre.leggauss(self._degree // 2 + 1)
        shape, slopes = _line_functions(xi, load.lines.shape[1])
        tangents = np.einsum("pa,eai->epi", slopes, load.points)
        positions = np.einsum("pa,eai->iep", shape, load.points).reshape(self._domain.dim, -1)
        weights = rule * np.linalg.norm(tangents, axis=2)
        self._parts.append(_Part(load.value, self._local(load.lines), shape, _in_space(positions), weights))

    def add_points(self, load: PointForce) -> None:
        """Add a force at nodes."""
        blocks = self._local(load.nodes)
        blocks = blocks[blocks < self._blocks][:, None]
        at = fem.block_points(self._space)[:, blocks[:, 0]]
        self._parts.append(_Part(load.value, blocks, np.ones((1, 1)), at, np.ones(blocks.shape)))

    def _local(self, nodes: NDArray[np.int64]) -> NDArray[np.int32]:
        """Owned blocks of nodes of the mesh; for those of other processes one after the last block."""
        order = np.argsort(self._owned)
        position = np.searchsorted(self._owned, nodes, sorter=order)
        block = order[np.minimum(position, len(order) - 1)] if len(order) else np.zeros(nodes.shape, dtype=np.int64)
        mine = self._owned[block] == nodes if len(order) else np.zeros(nodes.shape, dtype=bool)
        return np.where(mine, block, self._blocks).astype(np.int32)

    def update(self, t: float) -> bool:
        """Evaluate all loads at the time t [s]; returns False if none has changed.

        `force` [N] is at local dofs; contributions to dofs of other processes are not added up.
        """
        values = [evaluate_components(part.value, part.positions, t) for part in self._parts]
        if self._values is not None and all(map(np.array_equal, values, self._values)):
            return False
        self._values = values
        force = np.zeros((self._blocks + 1, self._domain.dim))
        for part, value in zip(self._parts, values, strict=True):
            for axis, component in enumerate(value):
                _add(force[:, axis], part.blocks, part.weights * component.reshape(part.weights.shape), part.shape)
        self.force = force[: self._blocks].ravel()
        return True


def _line_functions(xi: Array, nodes: int) -> tuple[Array, Array]:
    """Shape functions of a line on [-1, 1] (ends, then the middle) and their derivatives, shape (points, nodes)."""
    one = np.ones_like(xi)
    if nodes == 2:
        return np.stack([(1 - xi) / 2, (1 + xi) / 2], axis=1), np.stack([-one / 2, one / 2], axis=1)
    shape = np.stack([xi * (xi - 1) / 2, xi * (xi + 1) / 2, 1 - xi**2], axis=1)
    return shape, np.stack([xi - 0.5, xi + 0.5, -2 * xi], axis=1)


def _in_space(points: Array) -> Array:
    return np.pad(points, ((0, 3 - len(points)), (0, 0)))


def _add(out: Array, blocks: NDArray[np.int32], values: Array, shape: Array) -> None:
    """Add sum_q values_q N_a(x_q) to each node a of each entity; values: (entities, points)."""
    out += np.bincount(blocks.ravel(), (values @ shape).ravel(), minlength=len(out))


class FollowerPressure:
    """A pressure on a named surface in its deformed configuration."""

    def __init__(self, domain: fem.Domain, space, load: Pressure):
        self._dim, self._load = domain.dim, load
        self._points = np.ascontiguousarray(fem.block_points(space)[: domain.dim].T)
        self._facets = fem.facet_quadrature(domain, space, load.surface, domain.degree + LOAD_DEGREE)
        self._values: list[Array] = []

    def set_time(self, t: float) -> None:
        """Evaluate the pressure at the time t [s]."""
        self._values = [evaluate(self._load.value, f.positions, t).reshape(f.weights.shape) for f in self._facets]

    def add_force(self, u: Array, out: Array) -> None:
        """Add -int p n.v da [N] at the displacement u [m] to local dofs; both have the shape (local dofs,)."""
        x = self._points + u.reshape(-1, self._dim)
        force = out.reshape(-1, self._dim)
        for facets, p in zip(self._facets, self._values, strict=True):
            normal = facets.area_vectors(x)
            for axis in range(self._dim):
                _add(force[:, axis], facets.blocks, -p * facets.rule * normal[:, :, axis], facets.shape)

    def add_tangent(self, u: Array, matrix: PETSc.Mat) -> None:
        """Add d(int p n.v da)/du [N/m]; the matrix is not assembled."""
        x = self._points + u.reshape(-1, self._dim)
        for facets, p in zip(self._facets, self._values, strict=True):
            normal_by_node = _turn(facets, facets.tangents(x))
            weighted = facets.outward[:, None] * facets.rule * p
            block = np.einsum("ep,pa,epbij->eaibj", weighted, facets.shape, normal_by_node, optimize=True)
            dofs = self._dim * facets.blocks[:, :, None] + np.arange(self._dim, dtype=np.int32)
            rows = dofs.reshape(len(dofs), -1).astype(PETSc.IntType)
            matrix.setValuesLocalRCV(rows, rows, block.reshape(len(rows), rows.shape[1], -1), addv=True)


def _turn(facets: fem.Entities, tangents: Array) -> Array:
    """d(normal)/d(position of a node), shape (facets, points, nodes, dim, dim)."""
    if tangents.shape[-1] == 1:
        quarter = np.array([[0.0, 1.0], [-1.0, 0.0]])
        return np.broadcast_to(
            facets.slopes[None, :, :, 0, None, None] * quarter, (*tangents.shape[:2], facets.slopes.shape[1], 2, 2)
        )
    first, second = (_cross_matrix(tangents[..., k]) for k in (0, 1))
    by_first, by_second = (facets.slopes[None, :, :, k, None, None] for k in (0, 1))
    return by_second * first[:, :, None] - by_first * second[:, :, None]


def _cross_matrix(a: Array) -> Array:
    """[a] with [a] b = a x b, shape (..., 3) -> (..., 3, 3)."""
    zero = np.zeros_like(a[..., 0])
    rows = ((zero, -a[..., 2], a[..., 1]), (a[..., 2], zero, -a[..., 0]), (-a[..., 1], a[..., 0], zero))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
