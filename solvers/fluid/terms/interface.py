"""The interface operators: from the motion of surfaces to the rows of the flow, and from the flow to the force.

With the shape functions N_b of the vertices of a surface, g = sum_b N_b g_b, and the traction t of `nitsche`,

    C[(v, q), b i] = <t(v, 0) + q n, N_b e_i>                                    fluid rows:  r += C g
    f_b i = -<t(u, g) - p n, N_b e_i> = (C^T S (u, p) - M g)_bi,   S = -1 for u, +1 for p,   M = <P N_b, N_c>.

Both use the same moments of the same pieces, so that the sum of all forces vanishes to rounding errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.api import Array
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.weights import Weights
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms import nitsche
from solvers.fluid.terms.cell_blocks import CellBlocks, by_functions, cell_blocks
from solvers.fluid.terms.seepage import release
from solvers.fluid.terms.surface_terms import Piecewise, SurfaceOperators


@dataclass(frozen=True)
class MotionOperator:
    """An operator from the motion of a surface to the rows of the flow, by pieces: coefficients of shape functions."""

    fields: Array  #: coefficients of `InterfaceTerms.fields` in momentum rows (pieces, fields, component, motion)
    psi: Array  #: coefficients of psi in continuity rows (pieces, component of the motion)

    def __rmul__(self, factor: float) -> MotionOperator:
        return MotionOperator(factor * self.fields, factor * self.psi)

    def __add__(self, other: MotionOperator) -> MotionOperator:
        return MotionOperator(self.fields + other.fields, self.psi + other.psi)

    def of(self, by_motion: Array) -> MotionOperator:
        """The operator applied after a map of the motion, shape (pieces, dim, dim)."""
        pieces, fields, dim, _ = self.fields.shape
        by_field = self.fields.reshape(pieces, fields * dim, dim) @ by_motion
        return MotionOperator(by_field.reshape(self.fields.shape), np.einsum("pi,pij->pj", self.psi, by_motion))


class InterfaceTerms:
    """The operators of one cut, over the pieces in cells that this process owns."""

    def __init__(
        self,
        grid: DistributedGrid,
        unknowns: Unknowns,
        rule: Weights,
        cut: Cut,
        operators: SurfaceOperators,
        mu: float | Array,
        penalty: Array,
        slip_length: Array | None = None,
        transmissivity: Array | None = None,
        slip_inertia: Array | None = None,
    ):
        """operators: of the terms of surfaces; mu [Pa s], by pieces if it varies; penalty: P by pieces [Pa s/m];

        slip_length [m], transmissivity [m^3]: by facets, None if zero;
        slip_inertia: rho gamma_t h sum_k beta_k s_{n-k} at the corners of pieces [Pa], (pieces, dim), see
        `slip_history`; None: zero.
        """
        pieces = cut.pieces
        mine = cut.cut[pieces.cell] < grid.owned
        cells, facet = cut.cut[pieces.cell[mine]], pieces.facet[mine]
        mu = mu if isinstance(mu, float) else mu[mine]
        #: mean, for the derivatives by the motion of surfaces
        self.mu = mu if isinstance(mu, float) else float(mu.mean()) if len(mu) else 0.0
        self.dim, self._unknowns, self.vertices = grid.dim, unknowns, len(cut.motion.x)
        self.comm, self.periodic = grid.comm, unknowns.periodic
        moments = pieces.moments[mine][:, rule.order]
        self.n, self.mass_of_pieces, P = pieces.normal[mine], pieces.mass[mine], penalty[mine]
        self.cell, self.facet, self.corners = cells, facet, cut.facets[facet]
        self.x = cut.images.x[cut.images.facets[pieces.image[mine]]]
        self.sizes = grid.sizes[cells]
        self.u, self.p = unknowns.cell_velocity[cells], unknowns.cell_pressure[cells]
        phi, gradient = rule.velocity_table
        psi, psi_gradient = rule.pressure_table
        table = np.concatenate([phi[:, :, None], gradient], axis=2)
        #: int phi_a N_b, int grad phi_a N_b over each piece, shape (pieces, functions, vertices, 1 + dim)
        fields = np.tensordot(moments, table.reshape(len(table), -1), (1, 0))
        fields /= np.tile(np.insert(self.sizes, 0, 1.0, axis=1), table.shape[1])[:, None]
        self.fields = np.ascontiguousarray(fields.reshape(*fields.shape[:2], *table.shape[1:]).swapaxes(1, 2))
        #: traction along the normal by the slip of earlier steps, at the corners of pieces [Pa]; None: zero
        self.slip_inertia = None if slip_inertia is None else slip_inertia[mine]
        if self.slip_inertia is not None and transmissivity is not None:  # fluid passes through a layer
            self.slip_inertia[transmissivity[facet] > 0.0] = 0.0
        #: int psi_a N_b, (pieces, functions, vertices), and int grad psi_a, (pieces, functions, dim)
        self.psi = np.tensordot(moments, psi, (1, 0)).transpose(0, 2, 1)
        area = pieces.area[mine][:, rule.order]
        self.pressure_slope = np.tensordot(area, psi_gradient, (1, 0)) / self.sizes[:, None, :]
        D, along = np.zeros_like(P), self.n[:, :, None] * self.n[:, None, :]
        tangents, mobility = np.eye(self.dim) - along, None
        if slip_length is not None:
            D += nitsche.compliance(slip_length[facet] / mu, tangents, P)
        if transmissivity is not None:
            mobility = transmissivity[facet] / mu
            D += nitsche.compliance(release(mobility, self.sizes), along, P)
        self.surface = Piecewise(cells, self.n, P, D, mobility)
        origin = grid.origins(cells)
        by_g, leak, by_u, by_p = operators.motion(self.surface, origin)
        self.coupling = MotionOperator(by_g, leak)  #: C
        self.load = MotionOperator(by_u, by_p)  #: of the force by the flow, C^T S, transposed
        self.penalty = -by_g[:, 0]  #: of the force by -g, P; with slip and a layer P R
        self.cell_blocks: list[CellBlocks] = []  #: terms of slip and seepage in the rows of the flow
        if slip_length is not None or transmissivity is not None:
            momentum, slopes = operators.beside(self.surface, origin)
            parts = [(self.u, rule.velocity_table, momentum)]
            if mobility is not None:
                parts.insert(0, (self.p, rule.pressure_table, slopes))
            self.cell_blocks = [
                cell_blocks(cells, dofs, by_functions(area, functions, coefficients, self.sizes))
                for dofs, functions, coefficients in parts
            ]

    def at_corners(self, g: Array, of_facets: Array | None) -> Array:
        """Velocity [m/s] at the corners of pieces; g: of vertices, (vertices, dim); of_facets: added, (facets, dim)."""
        return g[self.corners] if of_facets is None else g[self.corners] + of_facets[self.facet, None]

    def velocity_terms(self, g: Array, of_facets: Array | None = None) -> Array:
        """C g at local dofs, contributions to ghosts not added up; velocities [m/s] as in `at_corners`."""
        g, fields, K = self.at_corners(g, of_facets), *self._flat(self.coupling)
        against = fields @ (g @ np.swapaxes(K, 1, 2)).reshape(len(g), fields.shape[2], self.dim)
        if self.slip_inertia is not None:
            of_slip = np.einsum("pav,pv->pa", self.fields[..., 0], self.slip_inertia)
            against -= (of_slip[..., None] * self.n[:, None]).reshape(against.shape)
        leak = np.einsum("pav,pv->pa", self.psi, np.einsum("pvi,pi->pv", g, self.coupling.psi))
        size = self._unknowns.local
        total: Array = np.bincount(self.u.ravel(), against.ravel(), size).astype(float)
        return total + np.bincount(self.p.ravel(), leak.ravel(), size)

    def force(self, flow: Array, g: Array, of_facets: Array | None = None) -> Array:
        """Contribution of this process to the force [N] on the vertices, shape (vertices, dim); flow at local dofs."""
        total = np.zeros((self.vertices, self.dim))
        np.add.at(total, self.corners, self._at_corners_of_pieces(flow, self.at_corners(g, of_facets)))
        return total

    def force_on_facets(self, flow: Array, g: Array, facets: int, of_facets: Array | None) -> tuple[Array, Array]:
        """Contribution of this process to the force [N] on each of the facets, (facets, dim), and to their wet area."""
        force = self._at_corners_of_pieces(flow, self.at_corners(g, of_facets)).sum(axis=1)
        total, area = np.zeros((facets, self.dim)), np.zeros(facets)
        np.add.at(total, self.facet, force)
        np.add.at(area, self.facet, self.mass_of_pieces.sum(axis=(1, 2)))
        return total, area

    def power_on_facets(self, flow: Array, g: Array, of_facets: Array) -> float:
        """Contribution of this process to the power [W] of the force on the velocity of facets that vertices lack."""
        force = self._at_corners_of_pieces(flow, self.at_corners(g, of_facets)).sum(axis=1)
        return float((force * of_facets[self.facet]).sum())

    def _at_corners_of_pieces(self, flow: Array, g: Array) -> Array:
        """Force [N] at the corners of pieces with the velocities g there, (pieces, vertices, dim)."""
        u, p, fields, K = flow[self.u], flow[self.p], *self._flat(self.load)
        force: Array = np.einsum("pav,pa->pv", self.psi, p)[:, :, None] * self.load.psi[:, None, :]
        force += (np.swapaxes(fields, 1, 2) @ u).reshape(*g.shape[:2], K.shape[1]) @ K
        force -= self.mass_of_pieces @ g @ np.swapaxes(self.penalty, 1, 2)
        if self.slip_inertia is not None:
            force -= (self.mass_of_pieces @ self.slip_inertia[..., None]) * self.n[:, None]
        return force

    def _flat(self, operator: MotionOperator) -> tuple[Array, Array]:
        """`fields` (pieces, functions, vertices x fields) and coefficients (pieces, fields x component, motion)."""
        pieces, functions, vertices, fields = self.fields.shape  # a process may have no pieces: no -1 below
        flat = self.fields.reshape(pieces, functions, vertices * fields)
        return flat, operator.fields.reshape(pieces, fields * self.dim, self.dim)

    @property
    def mass_blocks(self) -> Array:
        """M = -df/dg [kg/s] by pieces, shape (pieces, vertices, vertices, dim, dim)."""
        return self.mass_of_pieces[:, :, :, None, None] * self.penalty[:, None, None]
