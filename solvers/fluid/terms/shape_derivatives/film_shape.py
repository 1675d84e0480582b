"""Derivatives of the flow's rows and of its force by the motion of surfaces in films: exact where `shape` is not.

The discrete terms themselves are differentiated (docs/theory_fsci.md, Derivatives in films): f of `forms.film`, and of
the terms at the surface, `nitsche` and `seepage`. The velocity g moves with the surface. `film_crossings` has the part
of planes between cells, where f jumps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from mpi4py import MPI
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array, Indices32
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.weights import Weights
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms import forms, nitsche
from solvers.fluid.terms.interface import InterfaceTerms
from solvers.fluid.terms.seepage import layer
from solvers.fluid.terms.shape_derivatives.film_crossings import barycentric, crossing_moments, open_sides
from solvers.fluid.terms.shape_derivatives.shape import normal_derivative

#: Pieces that are evaluated together. Arrays at their quadrature points are large in 3D.
FILM_PIECES_AT_ONCE = 64


@dataclass(frozen=True)
class FilmDerivatives:
    """Dense blocks of some pieces of surface."""

    pieces: NDArray[np.int64]  #: of the interface
    dofs: Indices32  #: local dofs of the rows, (pieces, rows)
    rows: Array  #: (pieces, vertices, dim, rows)
    force: Array  #: of the force on vertices, (pieces, vertices, vertices, dim, dim), component of force first


class FilmIntegrands:
    """The terms of films at the points of cut cells, in this order along one axis: f, its slope, and df/dn.

    f is the integrand over the surface for each test function, or each component of the load. Its slope is that with
    the velocity g of the surface held.
    """

    def __init__(self, unknowns: Unknowns, flow: forms.Coefficients, function: Any, bulk: fem.Pointwise, points: Array):
        """flow: coefficients in cut cells; bulk: integrand over the fluid; points: of cut cells."""
        domain, dim, self.bulk, self._unknowns = unknowns.grid.domain, unknowns.dim, bulk, unknowns
        (u, p), (v, q) = unknowns.parts(function), unknowns.parts(ufl.TestFunction(unknowns.space))
        #: n, s, s_n, D n . n, kappa / mu, origin of the cell, g there and its gradient
        self._of_piece = c = fem.numbers_of_cells(domain, 3 * dim + 4 + dim**2)
        n, origin, g = (ufl.as_vector([c[k + i] for i in range(dim)]) for k in (0, dim + 4, 2 * dim + 4))
        slope = ufl.as_matrix([[c[3 * dim + 4 + dim * i + j] for j in range(dim)] for i in range(dim)])
        n = ufl.variable(n)
        g = ufl.variable(g + ufl.dot(slope, ufl.SpatialCoordinate(domain.mesh) - origin))
        P = c[dim] * ufl.Identity(dim) + c[dim + 1] * ufl.outer(n, n)
        terms = flow, n, P, c[dim + 2] * ufl.outer(n, n), u - g, u, p

        def moved(f: Any) -> list[Any]:
            along = [ufl.grad(f)[j] - ufl.dot(ufl.diff(f, g), slope[:, j]) for j in range(dim)]
            return [f, *along, *(ufl.diff(f, n)[k] for k in range(dim))]

        rows = moved(nitsche.at_compliant_surface(*terms, v, q) + layer(c[dim + 3], n, p, q))
        load = nitsche.load(*terms)
        of_load = [part for parts in zip(*(moved(load[i]) for i in range(dim)), strict=True) for part in parts]
        what = "the derivative of films by the motion of surfaces"
        self._rows, self._load = (
            fem.Pointwise(domain, ufl.as_vector(parts), points, what) for parts in (rows, of_load)
        )

    def on(self, at: InterfaceTerms, some: NDArray[np.int64], origin: Array, g: Array) -> tuple[Array, Array]:
        """Rows and load of some pieces of a surface, (pieces, points, 1 + 2 dim, rows or components).

        origin: of their cells [m], (pieces, dim); g: velocity of the surface at their corners [m/s].
        """
        n, P, D, dim = at.n[some], at.full_penalty[some], at.released[some], at.dim
        ends = np.concatenate([np.zeros((1, dim)), np.eye(dim)])
        there = barycentric(origin[:, None] + ends * at.sizes[some, None], at.x[some]) @ g
        slope = np.swapaxes(there[:, 1:] - there[:, :1], 1, 2) / at.sizes[some, None]
        total = np.einsum("ni,nik,nk->n", n, P, n)
        s, d = (np.einsum("nii->n", P) - total) / (dim - 1), np.einsum("ni,nik,nk->n", n, D, n)
        mobility = np.zeros(len(n)) if at.mobility is None else at.mobility[some]
        numbers = [n, np.stack([s, total - s, d, mobility], axis=1), origin, there[:, 0], slope.reshape(len(n), -1)]
        given = {self._of_piece: np.concatenate(numbers, axis=1)}
        rows, load = (part.on(at.cell[some], given) for part in (self._rows, self._load))
        return rows, load.reshape(*rows.shape[:3], dim)

    def compile(self) -> None:
        """Compile what is not yet (collective)."""
        for part in (self.bulk, self._rows, self._load):
            part.compile()

    def dofs(self, cells: Indices32) -> Indices32:
        """Local dofs of the rows of some local cells."""
        size = self._unknowns.block_size
        found: Indices32 = self._unknowns.cell_blocks[cells, :, None] * size + np.arange(size, dtype=np.int32)
        return found.reshape(len(cells), -1)


def film_derivatives(
    at: InterfaceTerms, rule: Weights, grid: DistributedGrid, cut: Cut, integrands: FilmIntegrands, g: Array
) -> FilmDerivatives | None:
    """Blocks of the pieces in cells with creeping flow; None if this process has none (collective).

    g: velocity of the surface at the corners of pieces [m/s], (pieces, vertices, dim).
    """
    if not grid.comm.allreduce(cut.creeping is not None, op=MPI.LOR):
        return None
    integrands.compile()
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
        moments = np.swapaxes(cut.pieces.moments[mine[pieces[some]]][:, rule.order], 1, 2)
        blocks.append(_blocks(at, pieces[some], rule, moments, origin[some], sides[some], integrands, g[pieces[some]]))
    rows, force = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    return FilmDerivatives(pieces, integrands.dofs(at.cell[pieces]), rows, force)


def _blocks(
    at: InterfaceTerms,
    some: NDArray[np.int64],
    rule: Weights,
    moments: Array,
    origin: Array,
    sides: NDArray[np.bool_],
    integrands: FilmIntegrands,
    g: Array,
) -> tuple[Array, Array]:
    """Blocks of some pieces. In subscripts n: pieces, q: points, b, c: vertices, k: components, j: displacements,

    r: rows. moments: int L_q N_c, (n, c, q).
    """
    n, sizes, x = at.n[some], at.sizes[some], at.x[some]
    slope = normal_derivative(x, n)
    lines = np.moveaxis(crossing_moments(x, n, origin, sizes, rule.reference, sides), 3, 2)
    cells, of_cell = np.unique(at.cell[some], return_inverse=True)
    surface, load = integrands.on(at, some, origin, g)
    rows = _moved(surface, moments, lines, n, slope)
    rows += n[:, None, :, None] * (moments @ integrands.bulk.on(cells)[of_cell])[:, :, None]
    on_facet = np.swapaxes(barycentric(origin[:, None] + rule.reference * sizes[:, None], x), 1, 2)
    weights = np.swapaxes(on_facet, 0, 1)[:, :, None]
    of_vertices = [_moved(load, moments * N, lines * N[:, :, None], n, slope) for N in weights]
    return rows, -np.stack(of_vertices, axis=1).swapaxes(3, 4)


def _moved(f: Array, moments: Array, lines: Array, n: Array, slope: Array) -> Array:
    """d int f ds by the motion of vertices, (n, c, j, r).

    f: with its slope and df/dn, (n, q, 1 + 2 dim, r); moments of it: int L_q N_c over pieces, (n, c, q), and over the
    lines where they cross planes, (n, c, j, q); slope: of `normal_derivative`.
    """
    (pieces, points, _, rows), dim, area = f.shape, n.shape[1], moments.sum(axis=1, keepdims=True)
    stretch = np.einsum("nk,nkcj->ncj", n, slope)
    turn = slope - n[:, :, None, None] * stretch[:, None]
    value, along, by_normal = f[:, :, 0], f[:, :, 1 : 1 + dim], f[:, :, 1 + dim :]
    found: Array = (moments @ along.reshape(pieces, points, -1)).reshape(pieces, -1, dim, rows)
    found -= (lines.reshape(pieces, -1, points) @ value).reshape(found.shape)
    found += stretch[..., None] * (area @ value)[:, None]
    turned = (area @ by_normal.reshape(pieces, points, -1)).reshape(pieces, dim, rows)
    return found + np.einsum("nkcj,nkr->ncjr", turn, turned)
