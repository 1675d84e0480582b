"""What fluid and surface exchange: velocity of the surface into the fluid, force of the fluid on the surface.

With N_b the shape functions of the surface's vertices and g = sum_b N_b g_b, Nitsche's terms of `forms.interface` for
the velocity g instead of u, and the same terms tested with the surface's motion, are one matrix C and its transpose:

    C[(v, q), b i] = <2 mu eps(v) n + q n, N_b e_i> - <P v, N_b e_i>       fluid rows:  r += C g
    f_b i = -<sigma(u, p) n - P (u - g), N_b e_i> = (C^T S (u, p) - M g)_bi,   S = -1 for u, +1 for p

Both come from the same moments of the same pieces, so that the sum of all forces vanishes to round-off.
Source: Massing, Schott, Wall, Comput. Methods Appl. Mech. Engrg. 328 (2018) 262-300, section 3.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from solvers.api import Array
from solvers.fluid.cut import Cut
from solvers.fluid.grid import DistributedGrid
from solvers.fluid.space import Unknowns
from solvers.fluid.weights import Weights


class Interface:
    """The operators of one cut, over the pieces in cells that this process owns."""

    def __init__(self, grid: DistributedGrid, unknowns: Unknowns, rule: Weights, cut: Cut, mu: float, penalty: Array):
        pieces = cut.pieces
        mine = cut.cut[pieces.cell] < grid.owned
        cells = cut.cut[pieces.cell[mine]]
        self.mu, self.dim, self._unknowns, self._vertices = mu, grid.dim, unknowns, len(cut.motion.x)
        moments = pieces.moments[mine][:, rule.order]
        self.n, self.penalty, self.mass_of_pieces = pieces.normal[mine], penalty[mine], pieces.mass[mine]
        self._corners = cut.facets[pieces.facet[mine]]
        self.x = cut.motion.x[self._corners]
        self.sizes = grid.sizes[cells]
        self.u, self.p = unknowns.cell_velocity[cells], unknowns.cell_pressure[cells]
        phi, gradient = rule.velocity_table
        psi, psi_gradient = rule.pressure_table
        #: int phi_a N_b, int grad phi_a N_b, int psi_a N_b, int d_n phi_a N_b and int grad psi_a over each piece
        self.phi = np.einsum("pqv,qa->pav", moments, phi, optimize=True)
        slope = np.einsum("pqv,qaj->pavj", moments, gradient, optimize=True)
        self.grad = slope / self.sizes[:, None, None, :]
        self.psi = np.einsum("pqv,qa->pav", moments, psi, optimize=True)
        self.normal_slope = np.einsum("pavj,pj->pav", self.grad, self.n)
        slope = np.einsum("pq,qaj->paj", moments.sum(axis=2), psi_gradient, optimize=True)
        self.pressure_slope = slope / self.sizes[:, None, :]

    def velocity_terms(self, g: Array) -> Array:
        """C g at local dofs, the ghosts' share still there; g [m/s] of shape (vertices, dim)."""
        g, n, mu = g[self._corners], self.n, self.mu
        against = np.einsum("pav,pvi->pai", mu * self.normal_slope, g)
        against += mu * np.einsum("pavj,pvj,pi->pai", self.grad, g, n, optimize=True)
        against -= np.einsum("pij,pav,pvj->pai", self.penalty, self.phi, g, optimize=True)
        leak = np.einsum("pav,pvi,pi->pa", self.psi, g, n, optimize=True)
        size = self._unknowns.local
        total: Array = np.bincount(self.u.ravel(), against.ravel(), size).astype(float)
        return total + np.bincount(self.p.ravel(), leak.ravel(), size)

    def force(self, flow: Array, g: Array) -> Array:
        """This process' share of the force [N] on the vertices, shape (vertices, dim); `flow` at local dofs."""
        u, p, n, mu = flow[self.u], flow[self.p], self.n, self.mu
        force = -mu * np.einsum("pav,pai->pvi", self.normal_slope, u)
        force -= mu * np.einsum("pavi,paj,pj->pvi", self.grad, u, n, optimize=True)
        force += np.einsum("pav,pa,pi->pvi", self.psi, p, n, optimize=True)
        slip = np.einsum("pav,pai->pvi", self.phi, u) - np.einsum("pvw,pwi->pvi", self.mass_of_pieces, g[self._corners])
        force += np.einsum("pij,pvj->pvi", self.penalty, slip)
        total = np.zeros((self._vertices, n.shape[1]))
        np.add.at(total, self._corners, force)
        return total

    @cached_property
    def matrix(self) -> sparse.csr_matrix:
        """C, ghosts' share still there, shape (local dofs, vertices dim)."""
        dim, mu, n = self.n.shape[1], self.mu, self.n
        identity = np.eye(dim)
        block = mu * self.normal_slope[:, :, None, :, None] * identity[:, None, :]
        block = block + mu * np.einsum("pavi,pk->pakvi", self.grad, n)
        block = block - np.einsum("pki,pav->pakvi", self.penalty, self.phi)
        leak = np.einsum("pav,pi->pavi", self.psi, n)
        return self.scatter(block, leak)

    @cached_property
    def mass(self) -> sparse.csr_matrix:
        """M: -df/dg [kg/s], shape (vertices dim, vertices dim)."""
        return self.scatter_surface(np.einsum("pij,pvw->pviwj", self.penalty, self.mass_of_pieces))

    def scatter(self, on_velocity: Array, on_pressure: Array) -> sparse.csr_matrix:
        """Blocks (pieces, functions, dim, vertices, dim) and (pieces, functions, vertices, dim) as one matrix."""
        columns = self._columns()
        parts = [
            (self.u[..., None, None], columns[:, None, None], on_velocity),
            (self.p[..., None, None], columns[:, None], on_pressure),
        ]
        return _assemble(parts, (self._unknowns.local, self.dim * self._vertices))

    def scatter_surface(self, block: Array) -> sparse.csr_matrix:
        """Blocks (pieces, vertices, dim, vertices, dim) as a matrix over the dofs of all vertices."""
        columns, size = self._columns(), self.dim * self._vertices
        return _assemble([(columns[..., None, None], columns[:, None, None], block)], (size, size))

    def _columns(self) -> NDArray[np.int64]:
        return self.dim * self._corners[:, :, None] + np.arange(self.dim)


def _assemble(parts, shape: tuple[int, int]) -> sparse.csr_matrix:
    """Sum of (rows, columns, values), each broadcast to the shape of the values."""
    rows, columns = (
        np.concatenate([np.broadcast_to(part[i], part[2].shape).ravel() for part in parts]) for i in (0, 1)
    )
    return sparse.csr_matrix((np.concatenate([part[2].ravel() for part in parts]), (rows, columns)), shape=shape)
