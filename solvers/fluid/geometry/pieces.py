"""Pieces of surface: parts of facets, each in the cell whose fluid it bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Indices
from solvers.fluid.grid.box import FLUSH, Grid
from solvers.mesh.lagrange import lagrange

#: Share of a cell (of its face) below which fluid (surface) in it is rounding error of the geometry.
NOTHING = 1e-10
#: Rounding error of a position, relative to the largest coordinate of the box: of some sums of rotated coordinates.
ROUNDING_OF_POSITION = 16 * np.finfo(float).eps


@dataclass(frozen=True)
class Pieces:
    """Pieces of surface in local cut cells, sorted by cell."""

    cell: NDArray[np.int64]  #: index into the cut cells
    facet: NDArray[np.int64]
    moments: Array  #: int L_q lambda_v ds [m^(dim-1)], shape (pieces, points, dim)
    mass: Array  #: int lambda_v lambda_w ds, shape (pieces, dim, dim)
    normal: Array  #: unit normal out of the fluid, shape (pieces, dim)
    image: NDArray[np.int64]  #: number of the facet among those of the images, see `Periods`

    @cached_property
    def area(self) -> Array:
        """int L_q ds, shape (pieces, points)."""
        first, *others = np.moveaxis(self.moments, 2, 0)
        return sum(others, start=first)  # NumPy's sum over three neighbours takes five times as long


def in_planes(grid: Grid, x: Array, share: float = 0.0) -> Array:
    """Vertices [m], those beside a plane of the grid by rounding, or by a share of the larger cell at it, put into it.

    Then the kernel knows from the normal which of the two cells has the fluid.
    """
    placed = x.copy()
    for axis, edge in enumerate(grid.edges):
        above = np.clip(np.searchsorted(edge, x[:, axis]), 1, len(edge) - 1)
        size = np.diff(edge)
        at_plane = np.maximum(np.append(size[:1], size), np.append(size, size[-1:]))
        reach = np.maximum(ROUNDING_OF_POSITION * float(np.abs(edge).max()), share * at_plane)
        for plane in (above - 1, above):
            near = np.abs(x[:, axis] - edge[plane]) <= reach[plane]
            placed[near, axis] = edge[plane[near]]
    return placed


def without_slivers(grid: Grid, facets: Indices, x: Array) -> Array:
    """Vertices [m] without slivers of fluid between facets and planes of the grid that the cut takes for solid.

    Those beside a plane by twice `NOTHING` are put into it: the mean of a wedge from the plane to there is `NOTHING`.
    So are facets on the boundary of the box, see `off_boundary`.
    """
    placed = in_planes(grid, x, 2.0 * NOTHING)
    for axis, edge in enumerate(grid.edges):
        near = FLUSH * float(np.diff(edge).min())
        for end in (edge[0], edge[-1]):
            flush = (np.abs(x[facets, axis] - end) <= near).all(axis=1)
            placed[facets[flush], axis] = end
    return placed


def off_boundary(grid: Grid, corners: Array, periodic: Sequence[int] = ()) -> NDArray[np.bool_]:
    """Mask of the facets that do not lie on the boundary of the box; those that do are in dry contact with it.

    Ends of `periodic` axes are no boundary.
    """
    off = np.ones(len(corners), dtype=bool)
    for axis, edge in enumerate(grid.edges):
        if axis in periodic:
            continue
        near = FLUSH * float(np.diff(edge).min())
        for end in (edge[0], edge[-1]):
            off &= (np.abs(corners[:, :, axis] - end) > near).any(axis=1)
    return off


def put_where_fluid_is(
    grid: Grid, points: Array, moments, normal: Array, full: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], Array]:
    """(cell of the box whose fluid each piece bounds, -1: none; moments of the piece in that cell).

    A piece in a `full` cell bounds no fluid there, nor does one in a face of a cell that is solid: it is inside of
    another body, or rounding put it on the wrong side of the face. In the latter case it is moved to the cell behind
    the face.
    moments: result of the kernel; normal: out of the fluid, (pieces, dim); points: of the quadrature in one direction.
    """
    cell, found = moments.cells[moments.piece_cell], moments.piece_moments
    solid = moments.fraction >= 1.0 - NOTHING
    inside = np.flatnonzero((solid | full)[cell])
    if not len(inside):
        return cell, found
    found, count, dim = found.copy(), len(points), grid.dim
    bounds = np.where(full[cell], -1, cell)
    axes = np.argmax(np.abs(normal), axis=1)
    index = np.stack(np.unravel_index(cell, grid.shape, order="F"))
    for axis in range(dim):
        for side in (0, 1):
            at = inside[(axes[inside] == axis) & ((normal[inside, axis] < 0.0) == bool(side))]
            if not len(at):
                continue
            by_layer = np.moveaxis(found[at].reshape(len(at), *[count] * dim, dim), dim - axis, 1)
            across = by_layer.sum(axis=1)
            area = across.reshape(len(at), -1).sum(axis=1)
            level = by_layer.reshape(len(at), count, -1).sum(axis=2)
            flush, covered = (level @ (points - face) ** 2 <= FLUSH**2 * area for face in (side, 1 - side))
            bounds[at[covered]] = -1
            next_index = index[axis, at] + (1 if side else -1)
            flush &= (next_index >= 0) & (next_index < grid.shape[axis])
            at, across = at[flush], across[flush]
            behind = cell[at] + (1 if side else -1) * int(np.prod(grid.shape[:axis]))
            bounds[at] = np.where((solid | full)[behind], -1, behind)
            moved = np.moveaxis(np.multiply.outer(lagrange(points, np.array(1.0 - side)), across), 1, 0)
            found[at] = np.moveaxis(moved, 1, dim - axis).reshape(len(at), count**dim, dim)
    return bounds, found


def cells_across(grid: Grid, points: Array, moments, periodic: Sequence[int] = ()) -> NDArray[np.int64]:
    """For pieces in a face of their cell, the cell of the box on the other side of the face; -1: there is none.

    Those at the ends of `periodic` axes are neighbours.

    moments: result of the kernel; points: of the quadrature in one direction.
    """
    cell, count, dim = moments.cells[moments.piece_cell], len(points), grid.dim
    by_point = moments.piece_moments.sum(axis=2).reshape(len(cell), *[count] * dim)
    area = moments.piece_moments.sum(axis=(1, 2))
    index = np.stack(np.unravel_index(cell, grid.shape, order="F"))
    across = np.full(len(cell), -1)
    for axis in range(dim):
        level = np.moveaxis(by_point, dim - axis, 1).reshape(len(cell), count, count ** (dim - 1)).sum(axis=2)
        for side, step in ((0, -1), (1, 1)):
            beside = index[axis] + step
            within = (beside >= 0) & (beside < grid.shape[axis]) | (axis in periodic)
            flush = level @ (points - side) ** 2 <= FLUSH**2 * area
            way = beside % grid.shape[axis] - index[axis]
            across = np.where(within & flush, cell + way * int(np.prod(grid.shape[:axis])), across)
    return across


def selected(pieces: Pieces, cell: NDArray[np.int64]) -> Pieces:
    """Pieces with other cells; those with a negative one are left out."""
    kept = np.flatnonzero(cell >= 0)
    others = (getattr(pieces, name)[kept] for name in ("facet", "moments", "mass", "normal", "image"))
    return Pieces(cell[kept], *others)


def joined_pieces(some: Sequence[Pieces]) -> Pieces:
    """All pieces, sorted by cell."""
    order = np.argsort(np.concatenate([pieces.cell for pieces in some]), kind="stable")
    names = ("cell", "facet", "moments", "mass", "normal", "image")
    return Pieces(*(np.concatenate([getattr(pieces, name) for pieces in some])[order] for name in names))


def place_of(grid: Grid, cells: Indices) -> tuple[Array, Array]:
    """(lowest corners, edges) [m] of cells of the box, shape (cells, dim)."""
    index = np.unravel_index(cells, grid.shape, order="F")
    low, high = (
        np.stack([edge[i + side] for edge, i in zip(grid.edges, index, strict=True)], axis=1) for side in (0, 1)
    )
    return low, high - low
