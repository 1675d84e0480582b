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
        moments = pieces.moments[mine][:, rule.order]
        self._mu, self._unknowns, self._vertices = mu, unknowns, len(cut.motion.x)
        self._n, self._penalty, self._mass = pieces.normal[mine], penalty[mine], pieces.mass[mine]
        self._corners = cut.facets[pieces.facet[mine]]
        self._u, self._p = unknowns.cell_velocity[cells], unknowns.cell_pressure[cells]
        phi, gradient = rule.velocity_table
        psi, _ = rule.pressure_table
        #: int phi_a N_b, int grad phi_a N_b and int psi_a N_b over each piece
        self._phi = np.einsum("pqv,qa->pav", moments, phi, optimize=True)
        slope = np.einsum("pqv,qaj->pavj", moments, gradient, optimize=True)
        self._grad = slope / grid.sizes[cells][:, None, None, :]
        self._psi = np.einsum("pqv,qa->pav", moments, psi, optimize=True)
        self._normal_slope = np.einsum("pavj,pj->pav", self._grad, self._n)

    def velocity_terms(self, g: Array) -> Array:
        """C g at local dofs, the ghosts' share still there; g [m/s] of shape (vertices, dim)."""
        g, n, mu = g[self._corners], self._n, self._mu
        against = np.einsum("pav,pvi->pai", mu * self._normal_slope, g)
        against += mu * np.einsum("pavj,pvj,pi->pai", self._grad, g, n, optimize=True)
        against -= np.einsum("pij,pav,pvj->pai", self._penalty, self._phi, g, optimize=True)
        leak = np.einsum("pav,pvi,pi->pa", self._psi, g, n, optimize=True)
        size = self._unknowns.local
        total: Array = np.bincount(self._u.ravel(), against.ravel(), size).astype(float)
        return total + np.bincount(self._p.ravel(), leak.ravel(), size)

    def force(self, flow: Array, g: Array) -> Array:
        """This process' share of the force [N] on the vertices, shape (vertices, dim); `flow` at local dofs."""
        u, p, n, mu = flow[self._u], flow[self._p], self._n, self._mu
        force = -mu * np.einsum("pav,pai->pvi", self._normal_slope, u)
        force -= mu * np.einsum("pavi,paj,pj->pvi", self._grad, u, n, optimize=True)
        force += np.einsum("pav,pa,pi->pvi", self._psi, p, n, optimize=True)
        slip = np.einsum("pav,pai->pvi", self._phi, u) - np.einsum("pvw,pwi->pvi", self._mass, g[self._corners])
        force += np.einsum("pij,pvj->pvi", self._penalty, slip)
        total = np.zeros((self._vertices, n.shape[1]))
        np.add.at(total, self._corners, force)
        return total

    @cached_property
    def matrix(self) -> sparse.csr_matrix:
        """C, ghosts' share still there, shape (local dofs, vertices dim)."""
        dim, mu, n = self._n.shape[1], self._mu, self._n
        identity = np.eye(dim)
        block = mu * self._normal_slope[:, :, None, :, None] * identity[:, None, :]
        block = block + mu * np.einsum("pavi,pk->pakvi", self._grad, n)
        block = block - np.einsum("pki,pav->pakvi", self._penalty, self._phi)
        leak = np.einsum("pav,pi->pavi", self._psi, n)
        columns = dim * self._corners[:, :, None] + np.arange(dim)
        rows = [np.broadcast_to(self._u[..., None, None], block.shape).ravel()]
        rows.append(np.broadcast_to(self._p[..., None, None], leak.shape).ravel())
        cols = [np.broadcast_to(columns[:, None, None], block.shape).ravel()]
        cols.append(np.broadcast_to(columns[:, None], leak.shape).ravel())
        data = np.concatenate([block.ravel(), leak.ravel()])
        shape = (self._unknowns.local, dim * self._vertices)
        return sparse.csr_matrix((data, (np.concatenate(rows), np.concatenate(cols))), shape=shape)

    @cached_property
    def mass(self) -> sparse.csr_matrix:
        """M: -df/dg [kg/s], shape (vertices dim, vertices dim)."""
        dim = self._n.shape[1]
        block = np.einsum("pij,pvw->pviwj", self._penalty, self._mass)
        dofs = dim * self._corners[:, :, None] + np.arange(dim)
        rows = np.broadcast_to(dofs[:, :, :, None, None], block.shape).ravel()
        cols = np.broadcast_to(dofs[:, None, None, :, :], block.shape).ravel()
        size = dim * self._vertices
        return sparse.csr_matrix((block.ravel(), (rows, cols)), shape=(size, size))
