"""Derivatives of the flow's rows and of its force by the motion of surfaces.

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
from solvers.fluid.terms.shape_derivatives.film_crossings import barycentric, crossing_moments
from solvers.fluid.terms.shape_derivatives.shape import normal_derivative
from solvers.fluid.terms.shape_derivatives.surface_integrands import MeanIntegrands
from solvers.fluid.terms.surface_terms import along_normal

#: Extent of a facet, in motions, from which on the end of a surface stays on it. Newton's method cycles in contact with
#: 1; with 3, 10, 100 and 1,000 `torus_wall` on 8 x 8 x 13 cells takes 231, 235, 242 and 249 iterations in all, without
#: this derivative 265.
EXTENT_THAT_HOLDS = 10.0

#: Cells that are evaluated together: integrands at their points are large for second degree in 3D.
CUT_CELLS_AT_ONCE = 256


@dataclass(frozen=True)
class FlowTerms:
    """The iterate, and the terms of the flow."""

    flow: Array  #: velocity [m/s] and pressure [Pa], at local dofs
    density: float  #: [kg/m^3]
    alpha: float  #: [1/s]
    convection: bool
    penalties: Penalties
    moving: tuple[fem.Pointwise, fem.Pointwise, MeanIntegrands]  #: of `CellForms`
    degree: int  #: of velocity
    gaps: GapTerms | None  #: None: for second degree
    moved: float  #: largest motion of a vertex in the last iterate [m], infinite in the first one
    velocity: Array  #: of the surface at the corners of pieces [m/s], (pieces, vertices, dim)


@dataclass(frozen=True)
class CutDerivatives:
    """Derivatives of all pieces of surface: an operator like C, and dense blocks, to be added up."""

    operator: MotionOperator
    #: of momentum and continuity (pieces, functions, vertices, dim, rows), component of rows last; for first degree one
    #: array, with the continuity equation's last
    rows: tuple[Array, ...]
    force: Array  #: of the force on vertices, (pieces, vertices, vertices, dim, dim), component of force first


def cut_derivatives(
    at: InterfaceTerms, rule: Weights, grid: DistributedGrid, cut: Cut, state: FlowTerms
) -> CutDerivatives:
    """Derivatives of all pieces of this process.

    In subscripts p: pieces, a: functions, c: vertices, i: rows of momentum and continuity, k, l: components, j:
    displacements.
    """
    n, dim, mine = at.n, at.dim, np.flatnonzero(cut.cut[cut.pieces.cell] < grid.owned)
    local, moments = cut.cut[cut.pieces.cell[mine]], cut.pieces.moments[mine][:, rule.order]
    index = np.stack(np.unravel_index(grid.numbers[local], grid.grid.shape, order="F"), axis=1)
    origin = grid.origins(local)

    means, slopes = _means(at, state.flow)
    area = moments.sum(axis=1)
    share = area / np.maximum(area.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    means[:, :dim] -= np.einsum("pc,pck->pk", share, state.velocity)
    inertia = np.zeros(len(n)) if at.slip_inertia is None else np.einsum("pc,pc->p", share, at.slip_inertia)
    found, of_slopes = state.moving[2].on(at, origin, inertia, means, slopes)
    f, along, by_shape = found[:, 0], found[:, 1 : 1 + dim], found[:, 1 + dim :]
    of_force, operator = (
        np.swapaxes(along[..., :dim], 1, 2),
        MotionOperator(np.empty((len(n), 1 + dim, dim, dim)), along[..., dim]),
    )
    operator.fields[:, 0], operator.fields[:, 1:] = of_force, of_slopes
    g = cut.motion.v[at.corners].mean(axis=1) * state.convection
    stretch, changes = _changes(at, g, inertia, state)
    changed = np.swapaxes(changes.reshape(len(n), changes.shape[1], dim**2), 1, 2) @ by_shape
    by_motion = stretch[..., None] * f[:, None, None] + changed.reshape(*stretch.shape, f.shape[1])

    force, leak = f[:, :dim], f[:, dim]
    rows = _rows(at, rule, moments, local, (by_motion[..., : dim + 1], leak), state)
    if at.surface.mobility is not None:
        rows[-1][..., -1] += np.einsum("pak,pcjk->pacj", at.pressure_slope, by_motion[..., dim + 1 :])

    loads = at.mass_of_pieces[..., None, None] * of_force[:, None, None]
    loads += area[:, :, None, None, None] * np.swapaxes(by_motion[..., :dim], 2, 3)[:, None]
    some, of_phi, of_psi, of_vertices = _ends_at_walls(at, rule, grid, index, origin, state.moved)
    rows[0][some, ..., :dim] -= of_phi[..., None] * force[some][:, None, None, None]
    rows[-1][some, ..., -1] -= of_psi * leak[some][:, None, None, None]
    loads[some] -= of_vertices[:, :, :, None] * force[some][:, None, None, :, None]
    return CutDerivatives(operator, rows, loads)


def _rows(
    at: InterfaceTerms, rule: Weights, moments: Array, local: Indices32, through: tuple[Array, Array], state: FlowTerms
) -> tuple[Array, ...]:
    """Rows as in `CutDerivatives`, of the fluid and of what goes through the surface.

    moments: int L_q N_c, (p, q, c); local: cell of each piece, sorted; through: traction and leak by the motion of
    vertices, (p, c, j, i), and the leak.
    """
    dim, (by_motion, leak) = at.dim, through
    parts = [(at.fields, slice(None), slice(None))]  # `fields`, components, and dofs of a cell
    if at.u.shape[1] > at.p.shape[1]:
        table = np.concatenate([rule.pressure_table[0][:, :, None], rule.pressure_table[1]], axis=2)
        fields = np.ascontiguousarray(np.tensordot(moments, table, (1, 0)).swapaxes(1, 2))
        fields[..., 1:] /= at.sizes[:, None, None, :]
        split = at.u.shape[1] * dim
        parts = [(at.fields, slice(dim), slice(split)), (fields, slice(dim, None), slice(split, None))]
    values = [np.ascontiguousarray(-by_motion[..., components]) for _, components, _ in parts]
    rows = tuple(np.empty((*part[0].shape[:3], *of.shape[2:])) for part, of in zip(parts, values, strict=True))
    cells, first = np.unique(local, return_index=True)
    ends = [*first.tolist(), len(local)]
    _density(cells[:0], state)  # compiles, also on processes without cells
    for start in range(0, len(cells), CUT_CELLS_AT_ONCE):
        here = cells[start : start + CUT_CELLS_AT_ONCE]
        density, some = _density(here, state), slice(ends[start], ends[start + len(here)])
        of_cell = np.searchsorted(here, local[some])
        for out, of, (fields, _, dofs) in zip(rows, values, parts, strict=True):
            by_function = density[..., dofs].reshape(*density.shape[:2], fields.shape[1], of.shape[3])
            by_function = np.ascontiguousarray(by_function)
            kernels.surface_rows(
                moments[some], by_function, of_cell, at.n[some], fields[some], of[some], -leak[some], out[some]
            )
    return rows


def _ends_at_walls(
    at: InterfaceTerms, rule: Weights, grid: DistributedGrid, index: NDArray[np.int64], origin: Array, moved: float
) -> tuple[NDArray[np.int64], Array, Array, Array]:
    """Pieces that end at the boundary of the box, and integrals of phi_a, psi_a, N_b times N_c e / s over these lines.

    Shapes (pieces, functions or vertices, vertices, dim); e and s: `film_crossings`.
    moved: motion [m] that is to be expected. A facet whose extent normal to the boundary is not much larger may cross
    the boundary or leave it as a whole, and does not count.
    """
    sides = np.stack([index == 0, index == np.array(grid.grid.shape) - 1], axis=2)
    sides[:, list(at.periodic)] = False  # ends of periods are planes of the grid like others
    sides &= (np.ptp(at.x, axis=1) > EXTENT_THAT_HOLDS * moved)[:, :, None]
    some = np.flatnonzero(sides.any(axis=(1, 2)))
    origin, x, sizes = origin[some], at.x[some], at.sizes[some]
    lines = crossing_moments(x, at.n[some], origin, sizes, rule.reference, sides[some])
    of_phi, of_psi = (
        np.einsum("pcqj,qa->pacj", lines, table) for table in (rule.velocity_table[0], rule.pressure_table[0])
    )
    on_facet = barycentric(origin[:, None] + rule.reference * sizes[:, None], x)
    return some, of_phi, of_psi, np.einsum("pcqj,pqb->pbcj", lines, on_facet)


def _means(at: InterfaceTerms, flow: Array) -> tuple[Array, Array]:
    """Means over pieces of velocity and pressure, (pieces, dim + 1), and of their slopes, (pieces, dim + 1, dim)."""
    area = at.psi.sum(axis=(1, 2))
    share = np.where(area > 0.0, 1.0 / np.where(area > 0.0, area, 1.0), 0.0)
    of_u = np.swapaxes(flow[at.u], 1, 2) @ at.fields.sum(axis=2)
    p = flow[at.p][:, None]
    of_p = p @ np.concatenate([at.psi.sum(axis=2)[..., None], at.pressure_slope], axis=2)
    means = share[:, None, None] * np.concatenate([of_u, of_p], axis=1)
    return means[..., 0], means[..., 1:]


def _changes(at: InterfaceTerms, g: Array, inertia: Array, state: FlowTerms) -> tuple[Array, Array]:
    """Relative derivatives of areas, (pieces, c, j), and those of normals and parameters of `surface_integrands`,

    (pieces, k, c, j), by the motion of vertices. g: mean velocity of each facet where there is convection.
    """
    n, dim, factors, slope = at.n, at.dim, state.penalties, normal_derivative(at.x, at.n)
    stretch = np.einsum("pk,pkcj->pcj", n, slope)
    turn = slope - n[:, :, None, None] * stretch[:, None]
    h = 1.0 / np.linalg.norm(n / at.sizes, axis=1)[:, None, None]
    dh = -(h**3) * np.einsum("pk,pkcj->pcj", n / at.sizes**2, turn)
    inflow = state.density * (np.einsum("pk,pk->p", g, n) < 0.0)[:, None, None]
    reduced = 1.0 if state.gaps is None else state.gaps.lengths(at.cell)[:, None, None]
    ds = -factors.nitsche * at.mu * TRACE[dim, state.degree] / (reduced * h**2) * dh
    ds -= inflow * (np.einsum("pk,pkcj->pcj", g, turn) + state.alpha / dim * n[:, None])
    ds_n = state.density * factors.mass * state.alpha * dh
    # D = 1 / (1 / c + s) in each direction
    d_n, d_t = (part[:, None, None] for part in along_normal(at.surface.released, n))
    parameters = ds, ds_n, inertia[:, None, None] * dh / h, -(d_n**2) * (ds + ds_n), -(d_t**2) * ds
    return stretch, np.concatenate([turn, np.stack(parameters, axis=1)], axis=1)


def _density(cells: Indices32, state: FlowTerms) -> Array:
    """Integrand over the fluid at points of local cells for each test function, (cells, q, a, i)."""
    found, gaps = state.moving[0].on(cells), None if state.gaps is None else state.gaps.marked
    if gaps is not None:
        found[gaps[cells]] += state.moving[1].on(cells[gaps[cells]])
    return found
