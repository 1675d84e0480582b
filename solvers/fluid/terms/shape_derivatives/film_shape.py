"""Derivatives of the flow's rows and of its force by the motion of surfaces in films: exact where `shape` is not.

The discrete terms themselves are differentiated (docs/theory_fsci.md, Derivatives in films): f of `forms.film`, and of
the terms at the surface, `nitsche` and `seepage`. The velocity g moves with the surface. `film_crossings` has the part
of planes between cells, where f jumps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array, Indices32
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.weights import Weights
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms.film_penalty import PenaltyDerivatives, fluid_of, penalty_derivatives
from solvers.fluid.terms.interface import InterfaceTerms
from solvers.fluid.terms.shape_derivatives.film_crossings import barycentric, crossing_moments, open_sides
from solvers.fluid.terms.shape_derivatives.shape import normal_derivative
from solvers.fluid.terms.shape_derivatives.surface_integrands import FilmIntegrands

#: Pieces that are evaluated together. Arrays at their quadrature points are large in 3D.
FILM_PIECES_AT_ONCE = 64


@dataclass(frozen=True)
class FilmDerivatives:
    """Dense blocks of some pieces of surface."""

    pieces: NDArray[np.int64]  #: of the interface
    dofs: Indices32  #: local dofs of the rows, (pieces, rows)
    rows: Array  #: (pieces, vertices, dim, rows)
    force: Array  #: of the force on vertices, (pieces, vertices, vertices, dim, dim), component of force first
    penalty: PenaltyDerivatives | None  #: of the least penalty, None where it is nowhere the largest


def film_derivatives(
    at: InterfaceTerms,
    unknowns: Unknowns,
    rule: Weights,
    cut: Cut,
    terms: tuple[fem.Pointwise, FilmIntegrands],
    g: Array,
    least: Array,
) -> FilmDerivatives | None:
    """Blocks of the pieces in cells with creeping flow; None if this process has none (collective).

    terms: integrands over the fluid and the surface; g: velocity of the surface at the corners of pieces [m/s]; least:
    penalty of all pieces of the cut that their cells ask for [Pa s/m], zero where another is larger.
    """
    grid = unknowns.grid
    if not grid.comm.allreduce(cut.creeping is not None, op=MPI.LOR):
        return None
    for part in terms:
        part.compile()
    if cut.creeping is None:
        return None
    mine = np.flatnonzero(cut.cut[cut.pieces.cell] < grid.owned)
    number = grid.numbers[cut.cut[cut.pieces.cell[mine]]]
    pieces = np.flatnonzero(cut.creeping[number])
    if not len(pieces):
        return None
    origin = grid.origins(at.cell[pieces])
    sides = open_sides(grid.grid, number[pieces], cut.creeping)
    blocks, by_penalty = [], []
    for first in range(0, len(pieces), FILM_PIECES_AT_ONCE):
        some = slice(first, first + FILM_PIECES_AT_ONCE)
        moments = np.swapaxes(cut.pieces.moments[mine[pieces[some]]][:, rule.order], 1, 2)
        *found, of_penalty = _blocks(at, pieces[some], rule, moments, origin[some], sides[some], terms, g[pieces[some]])
        blocks.append(found)
        by_penalty.append(of_penalty)
    rows, force = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    size, least = unknowns.block_size, least[mine[pieces]]
    dofs = unknowns.cell_blocks[at.cell[pieces], :, None] * size + np.arange(size, dtype=np.int32)
    dofs, penalty = dofs.reshape(len(pieces), -1), None
    if least.any():
        planes = open_sides(grid.grid, number[pieces], np.ones(grid.grid.size, dtype=bool))
        areas = _areas(at, pieces, cut.pieces.moments[mine[pieces]].sum(axis=1), origin, planes)
        rates = (np.concatenate(part) for part in zip(*by_penalty, strict=True))
        parts = tuple(least.reshape(-1, *[1] * (part.ndim - 1)) * part for part in rates)
        volume = fluid_of(cut, grid, at.cell[pieces])
        penalty = penalty_derivatives(at.cell[pieces], volume, areas, at.n[pieces], dofs, parts)
    return FilmDerivatives(pieces, dofs, rows, force, penalty)


def _areas(
    at: InterfaceTerms, some: NDArray[np.int64], of_vertices: Array, origin: Array, planes: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """int N_b ds of pieces, (pieces, vertices), and the derivative of their area by the motion of vertices.

    of_vertices: the former; origin: of their cells [m]; planes: those at which their ends move, (pieces, dim, 2).
    """
    x, n = at.x[some], at.n[some]
    lines = crossing_moments(x, n, origin, at.sizes[some], np.full((1, at.dim), 0.5), planes)[:, :, 0]
    stretch = np.einsum("nk,nkcj->ncj", n, normal_derivative(x, n))
    return of_vertices, stretch * of_vertices.sum(axis=1)[:, None, None] - lines


def _blocks(
    at: InterfaceTerms,
    some: NDArray[np.int64],
    rule: Weights,
    moments: Array,
    origin: Array,
    sides: NDArray[np.bool_],
    terms: tuple[fem.Pointwise, FilmIntegrands],
    g: Array,
) -> tuple[Array, Array, tuple[Array, Array]]:
    """Blocks of some pieces, and their rows and force on vertices by the penalty.

    In subscripts n: pieces, q: points, b, c: vertices, k: components, j: displacements, r: rows. moments: int L_q N_c,
    (n, c, q).
    """
    n, sizes, x = at.n[some], at.sizes[some], at.x[some]
    slope = normal_derivative(x, n)
    lines = np.moveaxis(crossing_moments(x, n, origin, sizes, rule.reference, sides), 3, 2)
    cells, of_cell = np.unique(at.cell[some], return_inverse=True)
    surface, force = terms[1].on(at, some, origin, g)
    rows = _moved(surface, moments, lines, n, slope)
    rows += n[:, None, :, None] * (moments @ terms[0].on(cells)[of_cell])[:, :, None]
    on_facet = np.swapaxes(barycentric(origin[:, None] + rule.reference * sizes[:, None], x), 1, 2)
    weights = np.swapaxes(on_facet, 0, 1)[:, :, None]
    of_vertices = [_moved(force, moments * N, lines * N[:, :, None], n, slope) for N in weights]
    area = moments.sum(axis=1, keepdims=True)
    of_force = np.concatenate([(area * N) @ force[:, :, -1] for N in weights], axis=1)
    return rows, np.stack(of_vertices, axis=1).swapaxes(3, 4), ((area @ surface[:, :, -1])[:, 0], of_force)


def _moved(f: Array, moments: Array, lines: Array, n: Array, slope: Array) -> Array:
    """d int f ds by the motion of vertices, (n, c, j, r).

    f: with its slope, df/dn and df/ds, (n, q, 2 + 2 dim, r); moments of it: int L_q N_c over pieces, (n, c, q), and
    over the lines where they cross planes, (n, c, j, q); slope: of `normal_derivative`.
    """
    (pieces, points, _, rows), dim, area = f.shape, n.shape[1], moments.sum(axis=1, keepdims=True)
    stretch = np.einsum("nk,nkcj->ncj", n, slope)
    turn = slope - n[:, :, None, None] * stretch[:, None]
    value, along, by_normal = f[:, :, 0], f[:, :, 1 : 1 + dim], f[:, :, 1 + dim : 1 + 2 * dim]
    found: Array = (moments @ along.reshape(pieces, points, -1)).reshape(pieces, -1, dim, rows)
    found -= (lines.reshape(pieces, -1, points) @ value).reshape(found.shape)
    found += stretch[..., None] * (area @ value)[:, None]
    turned = (area @ by_normal.reshape(pieces, points, -1)).reshape(pieces, dim, rows)
    return found + np.einsum("nkcj,nkr->ncjr", turn, turned)
