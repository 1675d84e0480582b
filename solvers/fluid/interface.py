"""What fluid and surface exchange: velocity of the surface into the fluid, force of the fluid on the surface.

With N_b the shape functions of the surface's vertices and g = sum_b N_b g_b, Nitsche's terms of `forms.interface` for
the velocity g instead of u, and the same terms tested with the surface's motion, are one matrix C and its transpose:

    C[(v, q), b i] = <2 mu eps(v) n + q n, N_b e_i> - <P v, N_b e_i>       fluid rows:  r += C g
    f_b i = -<sigma(u, p) n - P (u - g), N_b e_i> = (C^T S (u, p) - M g)_bi,   S = -1 for u, +1 for p

C and M have what `slip` adds along surfaces that the flow does not stick to.
Both come from the same moments of the same pieces, so that the sum of all forces vanishes to round-off.
Source: Massing, Schott, Wall, Comput. Methods Appl. Mech. Engrg. 328 (2018) 262-300, section 3.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.cell_blocks import CellBlocks, cell_blocks
from solvers.fluid.cut import Cut
from solvers.fluid.grid import DistributedGrid
from solvers.fluid.seepage import release_terms, seepage_terms
from solvers.fluid.slip import PieceIntegrals, SlipTerms, slip_terms
from solvers.fluid.space import Unknowns
from solvers.fluid.weights import Weights

#: By pieces: velocity rows (pieces, functions, dim, vertices, dim), pressure rows (pieces, functions, vertices, dim)
CouplingBlocks = tuple[Array, Array]


class InterfaceTerms:
    """The operators of one cut, over the pieces in cells that this process owns."""

    def __init__(
        self,
        grid: DistributedGrid,
        unknowns: Unknowns,
        rule: Weights,
        cut: Cut,
        mu: float,
        penalty: Array,
        slip_length: Array | None = None,
        transmissivity: Array | None = None,
    ):
        """penalty: P by pieces [Pa s/m]; slip_length [m], transmissivity [m^3]: by facets, None where all are zero."""
        pieces = cut.pieces
        mine = cut.cut[pieces.cell] < grid.owned
        cells = cut.cut[pieces.cell[mine]]
        self.mu, self.dim, self._unknowns, self.vertices = mu, grid.dim, unknowns, len(cut.motion.x)
        moments = pieces.moments[mine][:, rule.order]
        self.n, self.penalty, self.mass_of_pieces = pieces.normal[mine], penalty[mine], pieces.mass[mine]
        self.corners = cut.facets[pieces.facet[mine]]
        self.x = cut.motion.x[self.corners]
        self.sizes = grid.sizes[cells]
        self.u, self.p = unknowns.cell_velocity[cells], unknowns.cell_pressure[cells]
        phi, gradient = rule.velocity_table
        psi, psi_gradient = rule.pressure_table
        #: int phi_a N_b, int grad phi_a N_b, int psi_a N_b, int d_n phi_a N_b and int grad psi_a over each piece
        self.phi = np.tensordot(moments, phi, (1, 0)).transpose(0, 2, 1)
        slope = np.tensordot(moments, gradient, (1, 0)).transpose(0, 2, 1, 3)
        self.grad = slope / self.sizes[:, None, None, :]
        self.psi = np.tensordot(moments, psi, (1, 0)).transpose(0, 2, 1)
        self.normal_slope = np.einsum("pavj,pj->pav", self.grad, self.n)
        slope = np.tensordot(moments.sum(axis=2), psi_gradient, (1, 0))
        self.pressure_slope = slope / self.sizes[:, None, :]
        self.slip: SlipTerms | None = None  #: of slip and seepage together
        self.cell_blocks: list[CellBlocks] = []  #: what both add to the rows of the flow
        facet = pieces.facet[mine]
        at = PieceIntegrals(self.n, moments.sum(axis=2), self.phi, self.grad, self.mass_of_pieces, self.sizes)
        if slip_length is not None:
            self.slip = slip_terms(at, rule.velocity_table, mu, self.penalty, slip_length[facet])
        if transmissivity is not None:
            mobility = transmissivity[facet] / mu
            released = release_terms(at, rule.velocity_table, mu, self.penalty, mobility)
            self.slip = released if self.slip is None else self.slip + released
            self.cell_blocks = [cell_blocks(cells, self.p, seepage_terms(at, psi_gradient, mobility))]
        if self.slip is not None:
            self.cell_blocks.append(cell_blocks(cells, self.u, self.slip.flow))

    def velocity_terms(self, g: Array) -> Array:
        """C g at local dofs, the ghosts' share still there; g [m/s] of shape (vertices, dim)."""
        g, n, mu = g[self.corners], self.n, self.mu
        against = np.einsum("pav,pvi->pai", mu * self.normal_slope, g)
        against += mu * np.einsum("pavj,pvj->pa", self.grad, g)[:, :, None] * n[:, None, :]
        against -= np.einsum("pij,paj->pai", self.penalty, self.phi @ g)
        if self.slip is not None:
            against += np.einsum("pakvi,pvi->pak", self.slip.coupling, g)
        leak = np.einsum("pav,pv->pa", self.psi, np.einsum("pvi,pi->pv", g, n))
        size = self._unknowns.local
        total: Array = np.bincount(self.u.ravel(), against.ravel(), size).astype(float)
        return total + np.bincount(self.p.ravel(), leak.ravel(), size)

    def force(self, flow: Array, g: Array) -> Array:
        """This process' share of the force [N] on the vertices, shape (vertices, dim); `flow` at local dofs."""
        u, p, n, mu = flow[self.u], flow[self.p], self.n, self.mu
        force = -mu * np.einsum("pav,pai->pvi", self.normal_slope, u)
        force -= mu * np.einsum("pavi,pa->pvi", self.grad, np.einsum("paj,pj->pa", u, n))
        force += np.einsum("pav,pa->pv", self.psi, p)[:, :, None] * n[:, None, :]
        slip = np.einsum("pav,pai->pvi", self.phi, u) - np.einsum("pvw,pwi->pvi", self.mass_of_pieces, g[self.corners])
        force += np.einsum("pij,pvj->pvi", self.penalty, slip)
        if self.slip is not None:
            force -= np.einsum("pakvi,pak->pvi", self.slip.coupling, u)
            force -= np.einsum("pviwj,pwj->pvi", self.slip.mass, g[self.corners])
        total = np.zeros((self.vertices, n.shape[1]))
        np.add.at(total, self.corners, force)
        return total

    @cached_property
    def coupling_blocks(self) -> CouplingBlocks:
        """C by pieces."""
        mu, n = self.mu, self.n
        block = mu * np.einsum("pavi,pk->pakvi", self.grad, n)
        block -= np.einsum("pki,pav->pakvi", self.penalty, self.phi)
        for axis in range(self.dim):
            block[:, :, axis, :, axis] += mu * self.normal_slope
        if self.slip is not None:
            block += self.slip.coupling
        return block, np.einsum("pav,pi->pavi", self.psi, n)

    @cached_property
    def mass_blocks(self) -> Array:
        """M = -df/dg [kg/s] by pieces, shape (pieces, vertices, dim, vertices, dim)."""
        mass: Array = np.einsum("pij,pvw->pviwj", self.penalty, self.mass_of_pieces)
        return mass if self.slip is None else mass + self.slip.mass

    @cached_property
    def pattern(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(local dofs, dofs of the vertices) of the entries of `CouplingBlocks`, those of the velocity first."""
        columns, (on_velocity, on_pressure) = self._columns(), (block.shape for block in self.coupling_blocks)
        rows = [
            np.broadcast_to(self.u[..., None, None], on_velocity),
            np.broadcast_to(self.p[..., None, None], on_pressure),
        ]
        vertices = [
            np.broadcast_to(columns[:, None, None], on_velocity),
            np.broadcast_to(columns[:, None], on_pressure),
        ]
        return np.concatenate([part.ravel() for part in rows]), np.concatenate([part.ravel() for part in vertices])

    @cached_property
    def surface_pattern(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(rows, columns) of the entries of `mass_blocks` among the dofs of the vertices."""
        columns, shape = self._columns(), self.mass_blocks.shape
        return (
            np.broadcast_to(columns[..., None, None], shape).ravel(),
            np.broadcast_to(columns[:, None, None], shape).ravel(),
        )

    def _columns(self) -> NDArray[np.int64]:
        return self.dim * self.corners[:, :, None] + np.arange(self.dim)
