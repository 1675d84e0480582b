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

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.api import Array
from solvers.fluid.cell_blocks import CellBlocks, cell_blocks
from solvers.fluid.cut import Cut
from solvers.fluid.grid import DistributedGrid
from solvers.fluid.seepage import release_terms, seepage_terms
from solvers.fluid.slip import PieceIntegrals, SlipTerms, slip_terms
from solvers.fluid.space import Unknowns
from solvers.fluid.weights import Weights


@dataclass(frozen=True)
class MotionOperator:
    """An operator from the surface's motion to the flow's rows, by pieces."""

    fields: Array  #: of `InterfaceTerms.fields` in velocity rows (pieces, fields, component, component of the motion)
    psi: Array  #: of psi in pressure rows (pieces, component of the motion)
    blocks: Array | None = None  #: more in velocity rows (pieces, functions, dim, vertices, dim), with slip

    def __rmul__(self, factor: float) -> MotionOperator:
        return MotionOperator(
            factor * self.fields, factor * self.psi, None if self.blocks is None else factor * self.blocks
        )

    def __add__(self, other: MotionOperator) -> MotionOperator:
        """Both have blocks, or neither."""
        blocks = None if self.blocks is None or other.blocks is None else self.blocks + other.blocks
        return MotionOperator(self.fields + other.fields, self.psi + other.psi, blocks)


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
    def fields(self) -> Array:
        """int phi_a N_b, int d_n phi_a N_b, int d_i phi_a N_b by pieces, shape (pieces, functions, vertices, 2 + dim).

        Every operator between motion and velocity is these times coefficients of the piece.
        """
        return np.concatenate([self.phi[..., None], self.normal_slope[..., None], self.grad], axis=3)

    @cached_property
    def coupling(self) -> MotionOperator:
        """C."""
        dim, mu, n = self.dim, self.mu, self.n
        by_gradient = mu * np.einsum("ij,pk->pikj", np.eye(dim), n)
        by_slope = np.broadcast_to(mu * np.eye(dim), (len(n), 1, dim, dim))
        fields = np.concatenate([-self.penalty[:, None], by_slope, by_gradient], axis=1)
        return MotionOperator(fields, n, None if self.slip is None else self.slip.coupling)

    @cached_property
    def mass_blocks(self) -> Array:
        """M = -df/dg [kg/s] by pieces, shape (pieces, vertices, vertices, dim, dim)."""
        mass: Array = self.mass_of_pieces[:, :, :, None, None] * self.penalty[:, None, None]
        return mass if self.slip is None else mass + np.swapaxes(self.slip.mass, 2, 3)
