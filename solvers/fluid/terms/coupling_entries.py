"""The coupling blocks of a monolithic system: derivatives of the flow's rows and force by the motion of surfaces.

With the operators of `interface` and the derivatives of `shape`, for displacements d of the vertices of some bodies,
whose velocity is g = alpha d - ..., rows r and force f of the flow change by

    dr = (alpha C + S) dd,    df = C^T S dw - (alpha M + S_f) dd.

In films S and S_f are those of `film_shape`, elsewhere in flows in time those of `cut_shape`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.overlap import OverlappingBlocks
from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array
from solvers.exchange import InterfaceEntries
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms.film_penalty import PenaltyDerivatives
from solvers.fluid.terms.interface import InterfaceTerms, MotionOperator
from solvers.fluid.terms.shape_derivatives.cut_shape import CutDerivatives
from solvers.fluid.terms.shape_derivatives.film_shape import FilmDerivatives
from solvers.fluid.terms.shape_derivatives.shape import shape_derivatives


def interface_entries(
    operator: InterfaceTerms,
    unknowns: Unknowns,
    flow: Array,
    alpha: float,
    held: NDArray[np.bool_],
    vertices: NDArray[np.int64],
    shape: tuple[CutDerivatives | None, FilmDerivatives | None] = (None, None),
    swept: Array | None = None,
) -> InterfaceEntries:
    """Entries for the motion of some vertices, in the given order.

    flow: velocity and pressure at local dofs; held: local dofs with rows of the identity; alpha [1/s]: dg/dd;
    shape: derivatives by the shape of all pieces, None: those of the module `shape`, and those that replace them in
    films; swept: that of the velocity of facets beside that of their vertices, `Sweep.by_motion`.
    """
    C, sums = operator.coupling, _Sums(operator, unknowns, vertices)
    of_sweep = None if swept is None else _of_sweep(operator, swept[operator.facet])
    of_all, films = shape
    if of_all is None:
        by_shape, load_by_shape, rows = *shape_derivatives(operator, flow), []
    else:
        by_shape, load_by_shape, rows = of_all.operator, of_all.force, list(of_all.rows)
    if films is not None:
        for part in (by_shape.fields, by_shape.psi, load_by_shape, *rows):
            part[films.pieces] = 0.0
        load_by_shape[films.pieces] += films.force
    if of_sweep is not None and rows:
        rows[0][..., : operator.dim] += of_sweep.momentum
        rows[-1][..., -1:] += of_sweep.continuity
    elif of_sweep is not None:
        rows = of_sweep.rows(operator)
    into = sums.with_flow(alpha * C + by_shape, *rows)
    by_penalty = None
    if films is not None:
        into = into + sums.of_films(films)
        if films.penalty is not None:
            of_rows, by_penalty = sums.of_penalty(films.pieces, films.penalty)
            into = into + of_rows
    if of_sweep is not None:
        load_by_shape = load_by_shape + of_sweep.force
    into.data[held[into.indices]] = 0.0
    back = sums.with_flow(operator.load)
    load = sums.with_surface(-alpha * operator.mass_blocks + load_by_shape)
    if by_penalty is not None:
        load = load + by_penalty
    if unknowns.grid.comm.size > 1:
        into, back = (part.with_columns(unknowns.global_dofs, unknowns.size()) for part in (into, back))
    return InterfaceEntries(into, back, load)


@dataclass(frozen=True)
class _OfSweep:
    """Derivatives of all pieces by the velocity of their facets."""

    momentum: Array  #: (pieces, functions, vertices, dim, dim), component of rows last
    continuity: Array  #: (pieces, functions, vertices, dim, 1)
    force: Array  #: (pieces, vertices, vertices, dim, dim), component of force first

    def rows(self, operator: InterfaceTerms) -> list[Array]:
        """As `_Sums.with_flow` takes them."""
        parts = [self.momentum, self.continuity]
        return [np.concatenate(parts, axis=4)] if _together(operator) else parts


def _together(operator: InterfaceTerms) -> bool:
    """The functions of velocity are those of pressure."""
    return operator.u.shape[1] == operator.p.shape[1]


def _of_sweep(operator: InterfaceTerms, by_motion: Array) -> _OfSweep:
    """by_motion: of the velocity of facets, (pieces, k, vertices, j)."""
    C, (pieces, dim, vertices, _) = operator.coupling, by_motion.shape
    functions, by_motion = operator.u.shape[1], by_motion.reshape(pieces, dim, vertices * dim)
    of_facet = operator.fields.sum(axis=2) @ C.fields.reshape(pieces, 1 + dim, dim**2)
    momentum = of_facet.reshape(pieces, functions * dim, dim) @ by_motion
    flux = (C.psi[:, None] @ by_motion).reshape(pieces, 1, vertices, dim)
    load = (operator.penalty @ by_motion).reshape(pieces, 1, dim, vertices, dim).swapaxes(2, 3)
    return _OfSweep(
        momentum.reshape(pieces, functions, dim, vertices, dim).transpose(0, 1, 3, 4, 2),
        (operator.psi.sum(axis=2)[:, :, None, None] * flux)[..., None],
        -operator.mass_of_pieces.sum(axis=2)[:, :, None, None, None] * load,
    )


class _Sums:
    """Assembles matrices from blocks of pieces; rows are the dofs of some of the vertices."""

    def __init__(self, operator: InterfaceTerms, unknowns: Unknowns, vertices: NDArray[np.int64]):
        self._dim, number = operator.dim, np.full(operator.vertices, -1, dtype=np.int32)
        number[vertices] = np.arange(len(vertices))
        corner = number[operator.corners]
        self._ours = corner[:, 0] >= 0  # all vertices of a facet are of the same body
        self._corner = corner[self._ours]
        self._shape = (len(vertices), unknowns.local)
        self._u, self._p = operator.u, operator.p
        self._together = _together(operator)
        if self._together:
            self._both = self._beside(np.concatenate([operator.u, operator.p[..., None]], axis=2), operator.fields)
        else:
            self._velocity = self._beside(operator.u, operator.fields)
            self._pressure = self._beside(operator.p[:, :, None], operator.psi[..., None])

    def _beside(self, dofs: NDArray[np.int32], weights: Array) -> OverlappingBlocks:
        """Couplings of the vertices of each piece with functions of its cell.

        dofs: (pieces, functions, components); weights: of the coefficients, (pieces, functions, vertices, fields).
        """
        dofs, weights, shape = dofs[self._ours], weights[self._ours], (*dofs.shape[1:2], self._corner.shape[1])
        numbers = np.repeat(dofs.reshape(-1, dofs.shape[2]), shape[1], axis=0)
        rows = np.repeat(self._corner[:, None], shape[0], axis=1).ravel()
        pieces = np.repeat(np.arange(len(dofs), dtype=np.int32), shape[0] * shape[1])
        weights = weights.reshape(len(rows), weights.shape[3])
        columns = np.ascontiguousarray(numbers[:, 0])
        return OverlappingBlocks(rows, columns, numbers, weights, pieces, self._shape, self._shape[1])

    def with_flow(self, coefficients: MotionOperator, *blocks: Array) -> Sparse:
        """The transposed matrix of an operator; columns are local dofs of the flow.

        blocks: added to it, none or for first degree (pieces, functions, vertices, dim, dim + 1), for second degree
        those of momentum and of continuity.
        """
        more = [part[self._ours].reshape(-1, *part.shape[3:]) for part in blocks]
        velocity = np.swapaxes(coefficients.fields[self._ours], 2, 3)
        pressure = coefficients.psi[self._ours][:, None, :, None]
        if self._together:
            both = np.zeros((*velocity.shape[:3], self._dim + 1))
            both[..., :-1], both[:, :1, :, -1:] = velocity, pressure
            return self._both.matrix(both, *more).ordered()
        return (self._velocity.matrix(velocity, *more[:1]) + self._pressure.matrix(pressure, *more[1:])).ordered()

    def of_films(self, films: FilmDerivatives) -> Sparse:
        """The transposed matrix of the derivatives of rows in films; columns are local dofs of the flow."""
        some = self._ours[films.pieces]
        pieces = films.pieces[some]
        corner = np.cumsum(self._ours)[pieces] - 1
        rows = self._corner[corner][:, :, None] * self._dim + np.arange(self._dim)
        blocks = films.rows[some]
        into, by = rows[..., None], films.dofs[some][:, None, None]
        into, by, values = (np.broadcast_to(part, blocks.shape).ravel() for part in (into, by, blocks))
        return sparse_from_entries(into, by, values, (self._shape[0] * self._dim, self._shape[1]))

    def of_penalty(self, pieces: NDArray[np.int64], of: PenaltyDerivatives) -> tuple[Sparse, Sparse]:
        """As `of_films` and `with_surface`: what the penalty adds, which depends on all pieces in a cell."""
        some = self._ours[pieces]
        corner = (np.cumsum(self._ours) - 1)[pieces[some]]
        at = self._corner[corner][:, :, None] * self._dim + np.arange(self._dim)
        cell = np.broadcast_to(of.cell[some, None, None], at.shape).ravel()
        shape, (cells, columns) = (self._shape[0] * self._dim, len(of.rows)), of.rows.shape
        growth, force = (
            sparse_from_entries(at.ravel(), cell, part[some].ravel(), shape) for part in (of.growth, of.force)
        )
        of_cells = np.repeat(np.arange(cells), columns), of.dofs.ravel(), of.rows.ravel()
        return growth @ sparse_from_entries(*of_cells, (cells, self._shape[1])), force @ growth.T

    def with_surface(self, blocks: Array) -> Sparse:
        """The matrix of blocks (pieces, vertices, vertices, dim, dim); columns are dofs of the vertices."""
        dim, n, corner = self._dim, self._shape[0], self._corner
        rows, columns = (np.repeat(corner, corner.shape[1], axis=1).ravel(), np.tile(corner, corner.shape[1]).ravel())
        numbers = columns[:, None] * np.int32(dim) + np.arange(dim, dtype=np.int32)
        count = len(rows)
        each = np.ones((count, 1)), np.arange(count, dtype=np.int32)
        at = OverlappingBlocks(rows, columns, numbers, *each, (n, n), n * dim)
        return at.matrix(blocks[self._ours].reshape(count, 1, dim, dim))
