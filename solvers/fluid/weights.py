"""Integrals over the fluid and the surface in cut cells, as coefficients at quadrature points.

On a cell K with points x_q, weights w_q and Lagrange basis L_q on these points, a quantity c of the interface has

    W[c](K, q) = 1 / (w_q |K|) int_(Gamma in K) L_q c ds,   so that   sum_q w_q |K| f(x_q) W[c](K, q) = int_Gamma f c ds

exactly for every f in the tensor-product space of the points. Hence weak forms need no knowledge of the cut.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid.cut import Cut
from solvers.fluid.grid import DistributedGrid
from solvers.fluid.pieces import Pieces
from solvers.gauss import gauss


class Weights:
    """The coefficients of one grid: share of fluid, normal and penalty; zero outside cut cells."""

    def __init__(self, grid: DistributedGrid, velocity_degree: int):
        self.grid, dim, self.velocity_degree = grid, grid.dim, velocity_degree
        points_per_direction = 2 * velocity_degree + 1
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
        pieces, cells = cut.pieces, cut.cut
        size, area = len(cells), pieces.moments.sum(axis=2)
        self._fill(self.fluid, cells, cut.fluid[:, self.order])
        self._fill(self.n, cells, self._sum(np.einsum("pq,pi->pqi", area, pieces.normal), pieces, size))
        self._fill(self.penalty, cells, self._sum(np.einsum("pq,pij->pqij", area, penalty), pieces, size))

    def _sum(self, values: Array, pieces: Pieces, size: int) -> Array:
        """Sums over the pieces of each cut cell, points in the order of the rule, divided by the rule's weights."""
        total = np.zeros((size, *values.shape[1:]))
        if len(values):
            cells, starts = np.unique(pieces.cell, return_index=True)
            total[cells] = np.add.reduceat(values, starts, axis=0)
        return total[:, self.order]

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
