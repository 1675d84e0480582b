"""Integrals over the fluid and the surface in cut cells, as coefficients at quadrature points.

On a cell K with points x_q, weights w_q and Lagrange basis L_q on these points, a quantity c of the interface has

    W[c](K, q) = 1 / (w_q |K|) int_(Gamma in K) L_q c ds,   so that   sum_q w_q |K| f(x_q) W[c](K, q) = int_Gamma f c ds

exactly for every f in the tensor-product space of the points.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers import fem
from solvers.algebra.sparse import Sparse
from solvers.api import Array
from solvers.fluid.cut.cut import Cut
from solvers.fluid.geometry.pieces import Pieces
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.mesh.gauss import gauss


def count_of_points(velocity_degree: int, dim: int) -> int:
    """Points in each direction of a cut cell: products of two velocities are integrated exactly.

    With second degree in 2D so is the convective term, a product of three, whose points beyond a wall have the
    continued parabolas. In 3D it would take three times as many points.
    """
    of_velocities = 3 if velocity_degree > 1 and dim == 2 else 2
    return of_velocities * velocity_degree + 1


class Weights:
    """The coefficients of one grid: share of fluid, normal and penalty; zero outside cut cells."""

    def __init__(self, grid: DistributedGrid, velocity_degree: int):
        self.grid, dim, self.velocity_degree = grid, grid.dim, velocity_degree
        points_per_direction = count_of_points(velocity_degree, dim)
        self.degree = 2 * points_per_direction - 1
        domain = grid.domain
        self.reference, rule = fem.quadrature_points(domain, self.degree)
        self.points = gauss(points_per_direction)[0]
        assert len(rule) == points_per_direction**dim
        self.rule = rule
        #: number in the kernel (x fastest) of each point of the rule
        self.order = _kernel_numbers(self.reference, self.points)
        shapes: dict[str, tuple[int, ...]] = {
            "fluid": (), "n": (dim,), "penalty": (dim, dim),
        }  # fmt: skip
        spaces = {shape: fem.quadrature_space(domain, self.degree, shape) for shape in set(shapes.values())}
        functions = {name: fem.function(spaces[shape]) for name, shape in shapes.items()}
        self.fluid, self.n, self.penalty = functions["fluid"], functions["n"], functions["penalty"]

    @cached_property
    def velocity_table(self) -> tuple[Array, Array]:
        """Shape functions (points, functions) and reference gradients (points, functions, dim) of a velocity."""
        return fem.tabulate_lagrange(self.grid.domain, self.velocity_degree, self.reference)

    @cached_property
    def pressure_table(self) -> tuple[Array, Array]:
        """Shape functions and reference gradients of the pressure, of the same shapes."""
        return fem.tabulate_lagrange(self.grid.domain, 1, self.reference)

    def set(self, cut: Cut, penalty: Array) -> None:
        """Set the coefficients to those of a cut; penalty: tensors of its pieces [Pa s/m], (pieces, dim, dim)."""
        pieces, cells, dim = cut.pieces, cut.cut, self.grid.dim
        self._fill(self.fluid, cells, cut.fluid[:, self.order])
        both = np.concatenate([pieces.normal, penalty.reshape(len(penalty), dim * dim)], axis=1)
        total = self._integrate(pieces, both, len(cells))
        self._fill(self.n, cells, total[..., :dim])
        self._fill(self.penalty, cells, total[..., dim:].reshape(*total.shape[:2], dim, dim))

    def _integrate(self, pieces: Pieces, values: Array, size: int) -> Array:
        """int L_q c ds of values c of pieces, (pieces, n), in cut cells; shape (size, points, n)."""
        count = len(self.order)
        place = np.argsort(self.order)  # in the rule, of the points of the kernel
        area = Sparse(
            pieces.area.ravel(),
            (count * pieces.cell[:, None] + place).astype(np.int32).ravel(),
            count * np.arange(len(values) + 1, dtype=np.int32),
            (len(values), size * count),
        )
        return (area.T @ values).reshape(size, count, values.shape[1])

    def _fill(self, function, cells: NDArray[np.int32], values: Array) -> None:
        """Values at the points of cut cells, zero elsewhere; shape (cells, points, ...)."""
        if function is not self.fluid:
            scale = self.rule * self.grid.sizes[cells].prod(axis=1)[:, None]
            values = values / scale.reshape(*scale.shape, *([1] * (values.ndim - 2)))
        blocks = fem.cell_blocks(function.function_space)[cells]
        function.x.array[:] = 0.0
        function.x.array.reshape(-1, *values.shape[2:])[blocks] = values


def _kernel_numbers(reference: Array, points: Array) -> NDArray[np.int64]:
    """Number a + n b + n^2 c of each tensor point (x_a, y_b, z_c)."""
    index = np.argmin(np.abs(reference[:, :, None] - points), axis=2)
    return index @ len(points) ** np.arange(reference.shape[1])
