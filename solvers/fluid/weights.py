"""Integrals over cut cells and the interface in them as coefficients at quadrature points.

On a cell K with points x_q, weights w_q and Lagrange basis L_q on these points, a quantity c of the interface has

    W[c](K, q) = 1 / (w_q |K|) int_(Gamma in K) L_q c ds,   so that   sum_q w_q |K| f(x_q) W[c](K, q) = int_Gamma f c ds

exactly for every f in the tensor-product space of the points (design: all physics UFL, geometry as weights).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid.cut import Cut, Pieces
from solvers.fluid.grid import DistributedGrid


class Weights:
    """The coefficients of one grid: fluid part, normal, g n^T, and the penalties; zero outside cut cells."""

    def __init__(self, grid: DistributedGrid, points_per_direction: int):
        self.grid, dim = grid, grid.dim
        self.degree = 2 * points_per_direction - 1
        domain = grid.domain
        self.reference, rule = fem.quadrature_points(domain, self.degree)
        self.points = np.polynomial.legendre.leggauss(points_per_direction)[0] / 2.0 + 0.5
        assert len(rule) == points_per_direction**dim
        self.rule = rule
        #: kernel's number (x fastest) of each point of the rule
        self.order = _kernel_numbers(self.reference, self.points)
        shapes: dict[str, tuple[int, ...]] = {
            "fluid": (), "n": (dim,), "gn": (dim, dim), "penalty": (dim, dim), "penalty_g": (dim,),
        }  # fmt: skip
        spaces = {shape: fem.quadrature_space(domain, self.degree, shape) for shape in set(shapes.values())}
        functions = {name: fem.function(spaces[shape]) for name, shape in shapes.items()}
        self.fluid, self.n, self.gn = functions["fluid"], functions["n"], functions["gn"]
        self.penalty, self.penalty_g = functions["penalty"], functions["penalty_g"]

    def set(self, cut: Cut, penalty: Array, normal_penalty: Array) -> None:
        """Take a new cut and the penalties s, s_n [Pa s/m] of its pieces, each of shape (pieces,)."""
        pieces, cells = cut.pieces, cut.cut
        g = cut.motion.v[cut.facets[pieces.facet]]
        n, size = pieces.normal, len(cells)
        area = pieces.moments.sum(axis=2)
        moved = np.einsum("pqv,pvi->pqi", pieces.moments, g)
        self._fill(self.fluid, cells, cut.fluid[:, self.order])
        self._fill(self.n, cells, self._sum(np.einsum("pq,pi->pqi", area, n), pieces, size))
        self._fill(self.gn, cells, self._sum(np.einsum("pqi,pj->pqij", moved, n), pieces, size))
        tensor = penalty_tensors(penalty, normal_penalty, n)
        self._fill(self.penalty, cells, self._sum(np.einsum("pq,pij->pqij", area, tensor), pieces, size))
        self._fill(self.penalty_g, cells, self._sum(np.einsum("pqi,pij->pqj", moved, tensor), pieces, size))

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
        blocks = function.function_space.dofmap.list.array.reshape(-1, len(self.rule))[cells]
        function.x.array[:] = 0.0
        function.x.array.reshape(-1, *values.shape[2:])[blocks] = values


def penalty_tensors(penalty: Array, normal_penalty: Array, n: Array) -> Array:
    """s I + s_n n n^T of each piece."""
    identity = np.eye(n.shape[1])
    return penalty[:, None, None] * identity + normal_penalty[:, None, None] * n[:, :, None] * n[:, None, :]


def nodal_force(cut: Cut, weights: Weights, stress: Array, velocity: Array, tensors: Array, owned: int) -> Array:
    """Force [N] of the fluid on the vertices of the surface: the discrete reaction of the interface terms.

    f_b = int (-sigma n + P (u - g)) N_b ds over the pieces in the first `owned` cells; stress (cells, points, dim, dim)
    and velocity (cells, points, dim) on cut cells at the points of the rule, P the tensors of the pieces.
    """
    pieces = cut.pieces
    mine = cut.cut[pieces.cell] < owned
    cell, facet, n = pieces.cell[mine], pieces.facet[mine], pieces.normal[mine]
    moments = pieces.moments[mine][:, weights.order]
    traction = -np.einsum("pqij,pj->pqi", stress[cell], n) + np.einsum("pij,pqj->pqi", tensors[mine], velocity[cell])
    force = np.einsum("pqv,pqi->pvi", moments, traction)
    g = cut.motion.v[cut.facets[facet]]
    force -= np.einsum("pij,pvw,pwj->pvi", tensors[mine], pieces.mass[mine], g)
    total = np.zeros_like(cut.motion.x)
    np.add.at(total, cut.facets[facet], force)
    return total


def _kernel_numbers(reference: Array, points: Array) -> NDArray[np.int64]:
    """Number a + n b + n^2 c of each tensor point (x_a, y_b, z_c)."""
    index = np.argmin(np.abs(reference[:, :, None] - points), axis=2)
    return index @ len(points) ** np.arange(reference.shape[1])
