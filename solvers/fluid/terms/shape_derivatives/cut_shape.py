"""Derivatives of the flow's rows and of its force by the motion of surfaces, for first-degree velocities in time.

The discrete terms of `forms.bulk`, `forms.residual_based`, `forms.in_gaps` and `nitsche` themselves are differentiated
(docs/theory_coupling.md, Shape derivatives). Fields are averaged over each piece of surface; of terms that the slip
u - g multiplies by the viscosity those with d(n ds) are left out, as are second derivatives, stress jumps at the faces
of cells and ends of pieces at other surfaces. Where a surface ends at the boundary of the box its end moves, too, by
-e . dd / s (`film_crossings`), while the end stays on its facet: a body that is pressed onto a wall of the box goes
through it a little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers import fem, kernels
from solvers.api import Array, Indices32
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.weights import Weights
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.settings.penalties import TRACE, Penalties
from solvers.fluid.terms.gap_terms import GapTerms
from solvers.fluid.terms.interface import InterfaceTerms, MotionOperator
from solvers.fluid.terms.shape_derivatives.compliant_shape import PenaltyChanges, compliant_terms, layer_by_motion
from solvers.fluid.terms.shape_derivatives.film_crossings import barycentric, crossing_moments
from solvers.fluid.terms.shape_derivatives.shape import normal_derivative

#: Extent of a facet, in motions, from which on the end of a surface stays on it. Newton's method cycles in contact with
#: 1; with 3, 10, 100 and 1,000 `torus_wall` on 8 x 8 x 13 cells takes 231, 235, 242 and 249 iterations in all, without
#: this derivative 265.
EXTENT_THAT_HOLDS = 10.0


@dataclass(frozen=True)
class FlowTerms:
    """The iterate, and the terms of the flow."""

    flow: Array  #: velocity [m/s] and pressure [Pa], at local dofs
    density: float  #: [kg/m^3]
    alpha: float  #: [1/s]
    convection: bool
    penalties: Penalties
    integrands: tuple[fem.Pointwise, ...]  #: of `CellForms`
    gaps: GapTerms
    moved: float  #: largest motion of a vertex in the last iterate [m], infinite in the first one
    velocity: Array  #: of the surface at the corners of pieces [m/s], (pieces, vertices, dim)


@dataclass(frozen=True)
class CutDerivatives:
    """Derivatives of all pieces of surface: an operator like C, and dense blocks, to be added up."""

    operator: MotionOperator
    rows: Array  #: (pieces, functions, vertices, dim, dim + 1), component of rows last, the continuity equation's last
    force: Array  #: of the force on vertices, (pieces, vertices, vertices, dim, dim), component of force first


def cut_derivatives(
    at: InterfaceTerms, rule: Weights, grid: DistributedGrid, cut: Cut, state: FlowTerms
) -> CutDerivatives:
    """Derivatives of all pieces of this process.

    In subscripts p: pieces, a: functions, c: vertices, i: rows of momentum and continuity, k, l: components, j:
    displacements.
    """
    (n, mu, dim), mine = (at.n, at.mu, at.dim), np.flatnonzero(cut.cut[cut.pieces.cell] < grid.owned)
    local, moments = cut.cut[cut.pieces.cell[mine]], cut.pieces.moments[mine][:, rule.order]
    pieces, identity = len(mine), np.eye(dim)
    _, first, of_cell = np.unique(local, return_index=True, return_inverse=True)
    density = _density(local[first], state)
    density = density.reshape(*density.shape[:2], at.p.shape[1], dim + 1)

    slope = normal_derivative(at.x, n)
    both, slopes = _means(at, state.flow)
    du, dp, area = slopes[:, :dim], slopes[:, dim], moments.sum(axis=1)
    share = area / np.maximum(area.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    w = both[:, :dim] - np.einsum("pc,pck->pk", share, state.velocity)
    stress = mu * (du + np.swapaxes(du, 1, 2)) - both[:, dim, None, None] * identity
    inertia = np.zeros(pieces) if at.slip_inertia is None else np.einsum("pc,pc->p", share, at.slip_inertia)
    load = (stress @ n[:, :, None] - at.penalty @ w[:, :, None])[..., 0] + inertia[:, None] * n
    g = cut.motion.v[at.corners].mean(axis=1) * state.convection
    changes = _penalty_changes(at, g, slope, state, state.gaps.lengths(local))
    more = compliant_terms(at, mu * (du + np.swapaxes(du, 1, 2)), w, slope, changes)
    of_slip = du
    if more is not None:
        load, of_slip = load - more.load, du - more.gradient @ du
    dload = -(at.penalty @ du) - n[:, :, None] * dp[:, None]
    fields = np.empty((pieces, 1 + dim, dim, dim))
    fields[:, 0] = -dload
    fields[:, 1:] = -load[:, None, :, None] * identity[:, None] - mu * n[:, None, :, None] * of_slip[:, :, None]
    fields[:, 1:] -= mu * n[:, :, None, None] * of_slip[:, None]
    operator = MotionOperator(fields, -np.einsum("pkj,pk->pj", du, n))

    of_load = (stress @ slope.reshape(pieces, dim, dim * dim)).reshape(slope.shape)
    of_load -= _penalty_by_motion(at, slope, w, changes)
    of_load += inertia[:, None, None, None] * (slope + n[:, :, None, None] * changes.length[:, None])
    if more is not None:
        of_load -= more.by_motion
    by_motion = np.empty((pieces, dim, dim, dim + 1))
    by_motion[..., :dim] = of_load.transpose(0, 2, 3, 1)
    by_motion[..., dim] = np.einsum("pk,pkcj->pcj", w, slope)
    rows = np.empty((pieces, density.shape[2], *by_motion.shape[1:]))
    leak = np.einsum("pk,pk->p", w, n)
    kernels.surface_rows(moments, density, of_cell, n, at.fields, by_motion, leak, rows)
    if at.mobility is not None:
        rows[..., dim] += layer_by_motion(at, dp, slope)

    force = -at.mass_of_pieces[..., None, None] * dload[:, None, None]
    force -= area[:, :, None, None, None] * np.swapaxes(of_load, 1, 2)[:, None]
    some, of_phi, of_vertices = _ends_at_walls(at, rule, grid, local, state.moved)
    rows[some, ..., :dim] += of_phi[..., None] * load[some][:, None, None, None]
    rows[some, ..., dim] += of_phi * leak[some][:, None, None, None]
    force[some] += of_vertices[:, :, :, None] * load[some][:, None, None, :, None]
    return CutDerivatives(operator, rows, force)


def _ends_at_walls(
    at: InterfaceTerms, rule: Weights, grid: DistributedGrid, local: NDArray[np.int32], moved: float
) -> tuple[NDArray[np.int64], Array, Array]:
    """Pieces that end at the boundary of the box, and integrals of phi_a N_c e / s and N_b N_c e / s over these lines.

    Shapes (pieces, functions, vertices, dim) and (pieces, vertices, vertices, dim); e and s: `film_crossings`.
    moved: motion [m] that is to be expected. A facet whose extent normal to the boundary is not much larger may cross
    the boundary or leave it as a whole, and does not count.
    """
    index = np.stack(np.unravel_index(grid.numbers[local], grid.grid.shape, order="F"), axis=1)
    sides = np.stack([index == 0, index == np.array(grid.grid.shape) - 1], axis=2)
    sides &= (np.ptp(at.x, axis=1) > EXTENT_THAT_HOLDS * moved)[:, :, None]
    some = np.flatnonzero(sides.any(axis=(1, 2)))
    origin = np.stack([edge[i] for edge, i in zip(grid.grid.edges, index[some].T, strict=True)], axis=1)
    x, sizes = at.x[some], at.sizes[some]
    lines = crossing_moments(x, at.n[some], origin, sizes, rule.reference, sides[some])
    of_phi = np.einsum("pcqj,qa->pacj", lines, rule.velocity_table[0])
    on_facet = barycentric(origin[:, None] + rule.reference * sizes[:, None], x)
    return some, of_phi, np.einsum("pcqj,pqb->pbcj", lines, on_facet)


def _means(at: InterfaceTerms, flow: Array) -> tuple[Array, Array]:
    """Means over pieces of velocity and pressure, (pieces, dim + 1), and of their slopes, (pieces, dim + 1, dim)."""
    area = at.psi.sum(axis=(1, 2))
    share = np.where(area > 0.0, 1.0 / np.where(area > 0.0, area, 1.0), 0.0)
    nodal = np.concatenate([flow[at.u], flow[at.p][..., None]], axis=2)
    means = share[:, None, None] * (np.swapaxes(nodal, 1, 2) @ at.fields.sum(axis=2))
    return means[..., 0], means[..., 1:]


def _penalty_changes(at: InterfaceTerms, g: Array, slope: Array, state: FlowTerms, reduced: Array) -> PenaltyChanges:
    """Derivatives of s and s_n of `nitsche.penalties` by the motion of vertices.

    g: mean velocity of each facet where there is convection; slope: of `normal_derivative`.
    """
    n, dim, factors = at.n, at.dim, state.penalties
    turn = slope - n[:, :, None, None] * np.einsum("pk,pkcj->pcj", n, slope)[:, None]
    h = 1.0 / np.linalg.norm(n / at.sizes, axis=1)[:, None, None]
    dh = -(h**3) * np.einsum("pk,pkcj->pcj", n / at.sizes**2, turn)
    inflow = state.density * (np.einsum("pk,pk->p", g, n) < 0.0)[:, None, None]
    ds = -factors.nitsche * at.mu * TRACE[dim, 1] / (reduced[:, None, None] * h**2) * dh
    ds -= inflow * (np.einsum("pk,pkcj->pcj", g, turn) + state.alpha / dim * n[:, None])
    return PenaltyChanges(turn, ds, state.density * factors.mass * state.alpha * dh, dh / h)


def _penalty_by_motion(at: InterfaceTerms, slope: Array, w: Array, changes: PenaltyChanges) -> Array:
    """d(P ds) w / ds by the motion of vertices, (pieces, k, c, j), with the parts of P held; w: mean of u - g."""
    n, dim, turn = at.n, at.dim, changes.turn
    stretch = np.einsum("pk,pkcj->pcj", n, slope)
    total = np.einsum("pk,pkl,pl->p", n, at.penalty, n)
    along = total - (np.einsum("pkk->p", at.penalty) - total) / (dim - 1)
    w_n, w_turn = (w * n).sum(axis=1)[:, None, None, None], np.einsum("pl,plcj->pcj", w, turn)[:, None]
    of_n = n[:, :, None, None]
    found = (w[:, None] @ at.penalty)[:, 0, :, None, None] * stretch[:, None] + w[..., None, None] * changes.s[:, None]
    return found + along[:, None, None, None] * (turn * w_n + of_n * w_turn) + of_n * changes.normal[:, None] * w_n


def _density(cells: Indices32, state: FlowTerms) -> Array:
    """Integrand over the fluid at points of local cells for each test function, (cells, q, a, i)."""
    found, gaps = state.integrands[0].on(cells), state.gaps.marked
    if gaps is not None:
        found[gaps[cells]] += state.integrands[1].on(cells[gaps[cells]])
    return found
