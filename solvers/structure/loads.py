"""External forces on a body, integrated with the values of the loads at quadrature points.

    f_ext . v = int (b + rho g).v dX + int_G t.v dA - int_G p n.v da

Gravity g, body force b and traction t belong to the reference configuration; the pressure p follows the deformed
surface: n da is the cross product of the tangents of the deformed facet (in 2D the turned tangent), which is
J F^-T N dA. Source: Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis (2008), section 8.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.structure.materials import Parameter, Value

#: Loads of the third degree in x are integrated exactly over affine cells and facets, times the shape functions.
LOAD_DEGREE = 3


@dataclass(frozen=True)
class Traction:
    """Dead load [N/m^2 of reference surface]."""

    surface: str
    value: tuple[Value, ...]


@dataclass(frozen=True)
class Pressure:
    """Follower pressure [Pa], positive against the surface."""

    surface: str
    value: Value


class DeadLoads:
    """Loads that do not depend on the deformation: forces per volume and per area of the reference configuration."""

    def __init__(self, domain: fem.Domain, space):
        self._domain, self._space = domain, space
        self._parts: list[tuple[fem.Entities, tuple[Value, ...], Array | float]] = []
        self._values: list[Array] | None = None
        self.force = np.zeros(fem.function(space).x.array.shape)  #: at the last time, as `update` gives it [N]

    def add_volume(self, value: tuple[Value, ...], density: Parameter = 1.0) -> None:
        """A force per mass, or per volume without the density [kg/m^3], which is that of the cell's midpoint."""
        degree = self._domain.degree + LOAD_DEGREE
        for cells in fem.cell_quadrature(self._domain, self._space, degree):
            rho: Any = density
            if callable(rho):
                rho = rho(fem.cell_midpoints(self._domain), 0.0)[cells.cells][:, None]
            self._parts.append((cells, value, rho))

    def add_surface(self, surface: str, value: tuple[Value, ...]) -> None:
        """A force per area of a named surface."""
        degree = self._domain.degree + LOAD_DEGREE
        for facets in fem.facet_quadrature(self._domain, self._space, surface, degree):
            self._parts.append((facets, value, 1.0))

    def update(self, t: float) -> bool:
        """Evaluate all loads at time t; False if none has changed.

        `force` [N] is at local dofs: those of other processes wait for `accumulate`.
        """
        values = [np.stack([component(p.positions, t) for component in value]) for p, value, _ in self._parts]
        if self._values is not None and all(map(np.array_equal, values, self._values)):
            return False
        self._values = values
        force = np.zeros((len(self.force) // self._domain.dim, self._domain.dim))
        for (entities, _, factor), value in zip(self._parts, values, strict=True):
            weights = entities.weights * factor
            for axis, component in enumerate(value):
                _add(force[:, axis], entities, weights * component.reshape(weights.shape))
        self.force = force.ravel()
        return True


def _add(out: Array, entities: fem.Entities, values: Array) -> None:
    """Add sum_q values_q N_a(x_q) to the node a of each entity, values of shape (entities, points)."""
    np.add.at(out, entities.blocks, values @ entities.shape)


class FollowerPressure:
    """A pressure on a named surface as it is deformed."""

    def __init__(self, domain: fem.Domain, space, load: Pressure):
        self._dim, self._load = domain.dim, load
        self._points = np.ascontiguousarray(fem.block_points(space)[: domain.dim].T)
        self._facets = fem.facet_quadrature(domain, space, load.surface, domain.degree + LOAD_DEGREE)
        self._values: list[Array] = []

    def set_time(self, t: float) -> None:
        """Evaluate the pressure at time t."""
        self._values = [self._load.value(f.positions, t).reshape(f.weights.shape) for f in self._facets]

    def add_force(self, u: Array, out: Array) -> None:
        """Add -int p n.v da [N] at the displacement u to local dofs; both of the shape (local dofs,)."""
        x = self._points + u.reshape(-1, self._dim)
        force = out.reshape(-1, self._dim)
        for facets, p in zip(self._facets, self._values, strict=True):
            normal = facets.area_vectors(x)
            for axis in range(self._dim):
                _add(force[:, axis], facets, -p * facets.rule * normal[:, :, axis])

    def add_tangent(self, u: Array, matrix: PETSc.Mat) -> None:
        """Add d(int p n.v da)/du [N/m]; the matrix is not finished."""
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
