"""Derivatives of the flow's rows and of its force by the motion of surfaces in films: exact where `shape` is not.

The discrete terms themselves are differentiated (docs/theory_fsci.md, Derivatives in films): f of `forms.film`, and of
the terms at the surface, `nitsche` and `seepage`, whose part -<D t(u, g), t(v, 0)> is that of a layer. The velocity g
moves with the surface. `film_crossings` has the part of planes between cells, where f jumps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.weights import Weights
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.terms.interface import InterfaceTerms
from solvers.fluid.terms.shape_derivatives.film_crossings import barycentric, crossing_moments, open_sides
from solvers.fluid.terms.shape_derivatives.shape import normal_derivative

#: Pieces that are evaluated together. Arrays at their quadrature points are large in 3D.
FILM_PIECES_AT_ONCE = 64


@dataclass(frozen=True)
class FilmDerivatives:
    """Dense blocks of the pieces of surface in films."""

    pieces: NDArray[np.int64]  #: of the interface
    momentum: Array  #: (pieces, functions, dim, vertices, dim)
    continuity: Array  #: (pieces, functions, vertices, dim)
    force: Array  #: of the force on vertices, (pieces, vertices, dim, vertices, dim)


@dataclass(frozen=True)
class FilmFlow:
    """The iterate and the loads of the momentum equation: rho (alpha u - rate) - f."""

    flow: Array  #: velocity [m/s] and pressure [Pa] at local dofs
    rate: Array  #: alpha times the history and f / rho [m/s^2], at local dofs
    density: float  #: [kg/m^3]
    alpha: float  #: [1/s]
    velocity: Array  #: of the surface at the corners of pieces [m/s], (pieces, vertices, dim)


def film_derivatives(
    at: InterfaceTerms, rule: Weights, grid: DistributedGrid, cut: Cut, state: FilmFlow
) -> FilmDerivatives | None:
    """Blocks of the pieces in cells with creeping flow; None if this process has none."""
    if cut.creeping is None:
        return None
    mine = np.flatnonzero(cut.cut[cut.pieces.cell] < grid.owned)
    number = grid.numbers[cut.cut[cut.pieces.cell[mine]]]
    pieces = np.flatnonzero(cut.creeping[number])
    if not len(pieces):
        return None
    index = np.unravel_index(number[pieces], grid.grid.shape, order="F")
    origin = np.stack([edge[i] for edge, i in zip(grid.grid.edges, index, strict=True)], axis=1)
    sides = open_sides(grid.grid, number[pieces], cut.creeping)
    blocks = []
    for first in range(0, len(pieces), FILM_PIECES_AT_ONCE):
        some = slice(first, first + FILM_PIECES_AT_ONCE)
        moments = cut.pieces.moments[mine[pieces[some]]][:, rule.order]
        blocks.append(_blocks(at, pieces[some], rule, moments, origin[some], sides[some], state))
    return FilmDerivatives(pieces, *(np.concatenate(parts) for parts in zip(*blocks, strict=True)))


def _blocks(
    at: InterfaceTerms,
    some: NDArray[np.int64],
    rule: Weights,
    moments: Array,
    origin: Array,
    sides: NDArray[np.bool_],
    state: FilmFlow,
) -> tuple[Array, Array, Array]:
    """Blocks of some pieces. In subscripts n: pieces, q: points, a: functions, b, c: vertices, i, k, l: components,

    j: displacements.
    """
    (phi, grad_phi), (psi, grad_psi), mu = rule.velocity_table, rule.pressure_table, at.mu
    n, P, sizes, x, dim = at.n[some], at.full_penalty[some], at.sizes[some], at.x[some], at.dim
    on, area, slope = np.swapaxes(moments, 1, 2), moments.sum(axis=2), normal_derivative(x, n)
    v1, v2 = _slopes(phi, grad_phi, sizes)
    q1, q2 = _slopes(psi, grad_psi, sizes)
    nodal, p = state.flow[at.u[some]], state.flow[at.p[some]]
    u, rate = (np.einsum("qa,nai->nqi", phi, values) for values in (nodal, state.rate[at.u[some]]))
    du, ddu = np.einsum("nqaj,nai->nqij", v1, nodal), np.einsum("nqakj,nai->nqikj", v2, nodal)
    pressure, dp = np.einsum("qa,na->nq", psi, p), np.einsum("nqaj,na->nqj", q1, p)
    ddp = np.einsum("nqakj,na->nqkj", q2, p)
    stress, dstress = mu * (du + np.swapaxes(du, 2, 3)), mu * (ddu + np.swapaxes(ddu, 2, 3))
    lam = barycentric(origin[:, None] + rule.reference * sizes[:, None], x)
    w = u - np.einsum("nqb,nbi->nqi", lam, state.velocity[some])
    crossings = crossing_moments(x, n, origin, sizes, rule.reference, sides)

    stretch = np.einsum("nk,nkbj->nbj", n, slope)
    turn = slope - n[:, :, None, None] * stretch[:, None]
    total = np.einsum("ni,nik,nk->n", n, P, n)
    along = (total - (np.einsum("nii->n", P) - total) / (dim - 1))[:, None, None, None, None]
    dP = P[:, :, :, None, None] * stretch[:, None, None] + along * (
        turn[:, :, None] * n[:, None, :, None, None] + n[:, :, None, None, None] * turn[:, None]
    )
    # t - p n, its derivative along dd, and by the normal
    traction = np.einsum("nqik,nk->nqi", stress, n) - np.einsum("nik,nqk->nqi", P, w)
    dt = np.einsum("nqikj,nk->nqij", dstress, n) - np.einsum("nik,nqkj->nqij", P, du)
    by_normal = np.einsum("nqik,nkbj->nqibj", stress, slope) - np.einsum("nikbj,nqk->nqibj", dP, w)
    load = traction - pressure[..., None] * n[:, None]
    dload = dt - dp[:, :, None] * n[:, None, :, None]
    load_by_normal = by_normal - pressure[..., None, None, None] * slope[:, None]

    # bulk, and -<t - p n, v>
    bulk = state.density * (state.alpha * u - rate)[:, :, None] * phi[:, :, None]
    bulk = bulk + v1 @ (stress - pressure[..., None, None] * np.eye(dim))
    change = bulk[..., None] * n[:, None, None, None] - load[:, :, None, :, None] * v1[:, :, :, None]
    change -= dload[:, :, None] * phi[:, :, None, None]
    by_turn = -load_by_normal[:, :, None] * phi[:, :, None, None, None]
    # -<w, 2 mu eps(v) n>
    v1n, v2n = np.einsum("nqak,nk->nqa", v1, n), np.einsum("nqakj,nk->nqaj", v2, n)
    inner = np.einsum("nqlj,nqal->nqaj", du, v1) + np.einsum("nql,nqalj->nqaj", w, v2)
    change -= mu * inner[:, :, :, None] * n[:, None, None, :, None]
    change -= mu * (v1n[..., None, None] * du[:, :, None] + w[:, :, None, :, None] * v2n[:, :, :, None])
    w_v1, v1_turn = np.einsum("nql,nqal->nqa", w, v1), np.einsum("nqak,nkbj->nqabj", v1, slope)
    f = -load[:, :, None] * phi[:, :, None] - mu * (w_v1[..., None] * n[:, None, None] + v1n[..., None] * w[:, :, None])
    by_turn = by_turn - mu * w_v1[..., None, None, None] * slope[:, None, None]
    by_turn -= mu * w[:, :, None, :, None, None] * v1_turn[:, :, :, None]
    of_force, force_change, force_by_turn = load, dload, load_by_normal

    d = np.einsum("nii->n", at.released[some])
    if d.any():  # -<D t(u, g), t(v, 0)>, D = d n n^T, n . t(phi e_i, 0) = n_i s
        normal = n[:, None, :, None, None]
        T = np.einsum("nqi,ni->nq", traction, n)
        dT = np.einsum("nqij,ni->nqj", dt, n)
        T_by_turn = np.einsum("nqibj,ni->nqbj", by_normal, n) + np.einsum("nqi,nibj->nqbj", traction, turn)
        s, ds = 2.0 * mu * v1n - total[:, None, None] * phi, 2.0 * mu * v2n - total[:, None, None, None] * v1
        s_by_turn = 2.0 * mu * np.einsum("nqak,nkbj->nqabj", v1, turn)
        f -= (d[:, None, None] * T[:, :, None] * s)[..., None] * n[:, None, None]
        weight = d[:, None, None, None, None]
        product = dT[:, :, None] * s[..., None] + T[:, :, None, None] * ds
        change -= weight * n[:, None, None, :, None] * product[:, :, :, None]
        product = T_by_turn[:, :, None] * s[..., None, None] + T[:, :, None, None, None] * s_by_turn
        turned = (T[:, :, None] * s)[..., None, None, None] * turn[:, None, None]
        by_turn -= weight[..., None] * (n[:, None, None, :, None, None] * product[:, :, :, None] + turned)
        back = (total * d)[:, None, None, None]
        of_force = load - back[..., 0] * T[..., None] * n[:, None]
        force_change = dload - back * n[:, None, :, None] * dT[:, :, None]
        turned = normal * T_by_turn[:, :, None] + T[..., None, None, None] * turn[:, None]
        force_by_turn = load_by_normal - back[..., None] * turned

    momentum = _on(on, change) + _mean(area, by_turn) - _at_lines(crossings, f)
    # <q, div u> - <q, w . n>, and the layer
    flux = psi * np.einsum("nqii->nq", du)[..., None]
    change = flux[..., None] * n[:, None, None] - psi[..., None] * np.einsum("nqkj,nk->nqj", du, n)[:, :, None]
    w_n = np.einsum("nqk,nk->nq", w, n)
    change -= w_n[..., None, None] * q1
    f = -w_n[..., None] * psi
    by_turn = -psi[..., None, None] * np.einsum("nqk,nkbj->nqbj", w, slope)[:, :, None]
    if at.mobility is not None:
        m = at.mobility[some][:, None, None, None]
        tangents = np.eye(dim) - n[:, :, None] * n[:, None, :]
        q1t, dpt = q1 @ tangents[:, None], np.einsum("nik,nqk->nqi", tangents, dp)
        change += m * (np.einsum("nqak,nqkj->nqaj", q1t, ddp) + np.einsum("nqk,nqakj->nqaj", dpt, q2))
        f += m[..., 0] * np.einsum("nqk,nqak->nqa", dpt, q1)
        q1n, dpn = np.einsum("nqak,nk->nqa", q1, n), np.einsum("nqk,nk->nq", dp, n)
        turned = np.einsum("nqk,nqak->nqa", dpt, q1)[..., None, None] * stretch[:, None, None]
        turned -= q1n[..., None, None] * np.einsum("nqk,nkbj->nqbj", dp, turn)[:, :, None]
        turned -= dpn[:, :, None, None, None] * np.einsum("nqak,nkbj->nqabj", q1, turn)
        by_turn = by_turn + m[..., None] * turned
    continuity = _on(on, change) + _mean(area, by_turn) - _at_lines(crossings, f)
    # -<(I - P D) t - p n, N_c>
    change, by_turn = (
        -lam.reshape(*lam.shape, *[1] * k) * some[:, :, None] for k, some in ((2, force_change), (3, force_by_turn))
    )
    f = -lam[..., None] * of_force[:, :, None]
    return momentum, continuity, _on(on, change) + _mean(area, by_turn) - _at_lines(crossings, f)


def _on(on: Array, change: Array) -> Array:
    """Sum over points of the moments (pieces, vertices, points) and (pieces, points, ..., j); vertices before j."""
    pieces, points, *others, j = change.shape
    found = (on @ change.reshape(pieces, points, -1)).reshape(pieces, on.shape[1], *others, j)
    return np.moveaxis(found, 1, -2)


def _at_lines(crossings: Array, values: Array) -> Array:
    """Sum over points of the moments of lines (pieces, vertices, points, j) and (pieces, points, ...)."""
    pieces, points, *others = values.shape
    vertices, dim = crossings.shape[1], crossings.shape[3]
    moments = np.moveaxis(crossings, 2, 3).reshape(pieces, vertices * dim, points)
    found = (moments @ values.reshape(pieces, points, -1)).reshape(pieces, vertices, dim, *others)
    return np.moveaxis(found, (1, 2), (-2, -1))


def _mean(area: Array, values: Array) -> Array:
    """Sum over points of the areas (pieces, points) and (pieces, points, ...)."""
    return (area[:, None] @ values.reshape(*area.shape, -1)).reshape(len(area), *values.shape[2:])


def _slopes(values: Array, slopes: Array, sizes: Array) -> tuple[Array, Array]:
    """Gradients (pieces, points, functions, k) and second derivatives (..., k, j) of shape functions.

    values, slopes: of the reference cell, (points, functions) and (points, functions, dim). A slope is in the space of
    the functions, so that its slope is that of its interpolation.
    """
    second = np.einsum("qck,caj->qakj", slopes, np.einsum("cp,paj->caj", np.linalg.pinv(values), slopes))
    first = slopes / sizes[:, None, None]
    return first, second / (sizes[:, None, None, :, None] * sizes[:, None, None, None])
