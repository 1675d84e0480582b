"""Regions of the table of cut cells: their surface as pieces, where bodies touch, and how near they are closed."""

from __future__ import annotations

import numpy as np

from solvers.api import Array, Indices, Mask
from solvers.cut_cells import CellState, CutTable
from solvers.fluid.geometry.pieces import ROUNDING_OF_POSITION, Pieces, place_of
from solvers.fluid.grid.box import Grid
from solvers.mesh.tessellation import unit_normals

#: Closing length in rounding errors of a position. Two surfaces in 3D are 2 sqrt(3) of them apart, or less, where they
#: touch. Where they part at an angle, the end of what is closed is as long and bounds nothing: a longer one leaks.
TOUCHING = 8.0

#: Area of a face, and difference of volumes, relative to a cell, that are rounding error.
SAME_VOLUME = 1e-9


def closing_length(grid: Grid) -> float:
    """Gap [m] up to which surfaces touch: there is no fluid between them."""
    return float(TOUCHING * ROUNDING_OF_POSITION * max(np.abs(edge).max() for edge in grid.edges))


def with_several_bodies(grid: Grid, moments, body: Indices) -> Mask:
    """Mask of the cells with surface of several bodies; moments: of `kernels.moments`; body: of each facet."""
    bodies = int(body.max(initial=0)) + 1
    pairs = np.unique(moments.cells[moments.piece_cell] * bodies + body[moments.piece_facet])
    return np.asarray(np.bincount(pairs // bodies, minlength=grid.size) > 1)


def touching_cells(grid: Grid, moments, table: CutTable, several: Mask) -> Mask:
    """Mask of the cells in which bodies touch or overlap, among those with several bodies.

    Their union has less volume than they have together, or less surface, or something is closed.
    moments: of `kernels.moments`, sums over the bodies.
    """
    volume = np.where(table.state == CellState.FLUID, 1.0, np.bincount(table.cell, table.share, grid.size))
    area = np.bincount(moments.cells[moments.piece_cell], moments.piece_mass.sum(axis=(1, 2)), grid.size)
    area -= np.bincount(table.cell[table.piece_region], table.piece_area, grid.size)
    differ = np.abs(volume - 1.0 + moments.fraction) > SAME_VOLUME
    differ |= np.abs(area) > SAME_VOLUME * largest_faces(grid)
    differ[table.closed_cell] = True
    return np.asarray(several & differ)


def largest_faces(grid: Grid) -> Array:
    """Area of the largest face of each cell [m^(dim - 1)]."""
    sizes = grid.cell_sizes()
    return np.asarray(sizes.prod(axis=1) / sizes.min(axis=1))


def pieces_of_regions(table: CutTable, points: Array, grid: Grid, facets: Indices, x: Array, rows: Indices) -> Pieces:
    """Pieces of surface that bound regions of a table, sorted by region.

    points: Gauss points of the table; facets, x: of its surfaces [m]; rows: among the cut cells, of each region, -1:
    that region is left out.
    """
    row = rows[table.piece_region]
    some = np.flatnonzero(row >= 0)
    facet, moments = table.piece_facet[some], table.piece_moments[some]
    low, size = place_of(grid, table.cell[table.piece_region[some]])
    tensor = np.stack(np.meshgrid(*[points] * grid.dim, indexing="ij"), axis=-1).reshape(-1, grid.dim)[:, ::-1]
    at = low[:, None] + size[:, None] * tensor
    # a linear function is known from its values at the points
    mass = np.swapaxes(moments, 1, 2) @ _barycentric(x[facets[facet]], at)
    return Pieces(row[some], facet, moments, 0.5 * (mass + np.swapaxes(mass, 1, 2)), -unit_normals(x[facets])[facet])


def _barycentric(corners: Array, at: Array) -> Array:
    """Barycentric coordinates of points (p, g, dim), projected into the planes of facets (p, dim, dim)."""
    ways, way = corners[:, 1:] - corners[:, :1], at - corners[:, :1]
    gram = ways @ np.swapaxes(ways, 1, 2)
    found = np.swapaxes(np.linalg.solve(gram, ways @ np.swapaxes(way, 1, 2)), 1, 2)
    return np.concatenate([1.0 - found.sum(axis=2, keepdims=True), found], axis=2)
