"""Regions of the table of cut cells: their surface as pieces, where bodies touch, and how near they are closed."""

from __future__ import annotations

import numpy as np

from solvers.api import Array, Indices, Mask
from solvers.cut_cells import CellState, CutTable
from solvers.fluid.geometry.pieces import ROUNDING_OF_POSITION, Pieces, joined_pieces, place_of
from solvers.fluid.grid.box import Grid
from solvers.mesh.lagrange import lagrange, lagrange_slopes
from solvers.mesh.tessellation import unit_normals

#: Gap, relative to the smallest cell, up to which surfaces touch: there is no fluid between them. Contact leaves gaps
#: of 1e-9 to 1e-8. A wedge ends where it is as thin as this. Its end moves by 1 / angle of what the surfaces do, which
#: no tangent knows: Newton's method converges linearly, at a rate that is proportional to this length. Between the
#: leaflets of a valve it is 0.75 with 1e-6, 0.03 with 1e-7, 4e-4 with 1e-8.
TOUCHING = 1e-7

#: Gap, in rounding errors of a position, up to which two surfaces in 3D may be the same: 2 sqrt(3), and some more.
ROUNDINGS_APART = 8.0

#: Distance from the box, in its largest extent, that is far; positions are rounded to 2^-61 of the largest.
FAR_OUTSIDE = 2.0**12

#: Area of a face, and difference of volumes, relative to a cell, that are rounding error.
SAME_VOLUME = 1e-9

#: Area, relative to a face of the cell, of ends of what is closed that is rounding error of sums over its boundary.
ROUNDING_OF_AREA = 1e-13


def closing_length(grid: Grid) -> float:
    """Gap [m] up to which surfaces touch: there is no fluid between them."""
    return TOUCHING * min(float(np.diff(edge).min()) for edge in grid.edges)


def length_of_rounding(grid: Grid) -> float:
    """Gap [m] of surfaces that lie in each other but for rounding."""
    return float(ROUNDINGS_APART * ROUNDING_OF_POSITION * max(np.abs(edge).max() for edge in grid.edges))


def within_reach(grid: Grid, x: Array) -> Array:
    """Vertices [m], those that are far from the box put closer, where they cut no cell either.

    Bodies of an iterate that diverges may be anywhere, and positions are whole numbers in the table.
    """
    low, high = (np.array([edge[end] for edge in grid.edges]) for end in (0, -1))
    reach = FAR_OUTSIDE * float((high - low).max())
    return np.clip(x, low - reach, high + reach)


def with_several_bodies(grid: Grid, moments, body: Indices) -> Mask:
    """Mask of the cells with surface of several bodies; moments: of `kernels.moments`; body: of each facet."""
    bodies = int(body.max(initial=0)) + 1
    pairs = np.unique(moments.cells[moments.piece_cell] * bodies + body[moments.piece_facet])
    return np.asarray(np.bincount(pairs // bodies, minlength=grid.size) > 1)


def touching_cells(grid: Grid, moments, table: CutTable, several: Mask, facets: Indices, x: Array) -> Mask:
    """Mask of the cells in which bodies touch or overlap, among those with several bodies.

    Their union has less volume than they have together, or less surface, or something is closed.
    moments: of `kernels.moments`, sums over the bodies; x: vertices [m], those on the boundary of the box exactly.
    """
    volume = np.where(table.state == CellState.FLUID, 1.0, np.bincount(table.cell, table.share, grid.size))
    within = ~_out_of_box(grid, x[facets])[moments.piece_facet]
    area = np.bincount(moments.cells[moments.piece_cell], within * moments.piece_mass.sum(axis=(1, 2)), grid.size)
    area -= np.bincount(table.cell[table.piece_region], table.piece_area, grid.size)
    differ = np.abs(volume - 1.0 + moments.fraction) > SAME_VOLUME
    differ |= np.abs(area) > SAME_VOLUME * largest_faces(grid)
    differ[table.closed_cell] = True
    return np.asarray(several & differ)


def _out_of_box(grid: Grid, corners: Array) -> Mask:
    """Mask of the facets in faces of the box with the solid inside: they bound no fluid, though they have moments."""
    normal, found = unit_normals(corners), np.zeros(len(corners), dtype=bool)
    for axis, edge in enumerate(grid.edges):
        for end, outward in ((0, -1.0), (-1, 1.0)):
            found |= (corners[:, :, axis] == edge[end]).all(axis=1) & (outward * normal[:, axis] > 0.0)
    return found


def largest_faces(grid: Grid) -> Array:
    """Area of the largest face of each cell [m^(dim - 1)]."""
    sizes = grid.cell_sizes()
    return np.asarray(sizes.prod(axis=1) / sizes.min(axis=1))


def pieces_of_regions(table: CutTable, points: Array, grid: Grid, facets: Indices, x: Array, rows: Indices) -> Pieces:
    """Pieces of surface that bound regions of a table, and the ends of what is closed.

    points: Gauss points of the table; facets, x: of its surfaces [m]; rows: among the cut cells, of each region, -1:
    that region is left out.
    """
    row = rows[table.piece_region]
    some = np.flatnonzero(row >= 0)
    facet, moments = table.piece_facet[some], table.piece_moments[some]
    # a linear function is known from its values at the points
    mass = np.swapaxes(moments, 1, 2) @ _at_points(table, points, grid, x[facets[facet]], table.piece_region[some])
    normal = -unit_normals(x[facets])
    surface = Pieces(row[some], facet, moments, 0.5 * (mass + np.swapaxes(mass, 1, 2)), normal[facet], facet)
    exact = np.flatnonzero((rows >= 0) & table.exact[table.cell])
    if not len(exact):
        return surface
    ends = _ends(table, points, grid, normal, exact)
    region, axis = np.nonzero(
        np.abs(ends).max(axis=1, initial=0.0) > ROUNDING_OF_AREA * largest_faces(grid)[table.cell, None]
    )
    if not len(region):
        return surface
    along = ends[region, :, axis]
    sign = np.where(along.sum(axis=1) < 0.0, -1.0, 1.0)
    beside = _facets_beside(table)[region]
    at = _at_points(table, points, grid, x[facets[beside]], region)
    moments = (sign[:, None] * along)[:, :, None] * at
    mass = np.swapaxes(moments, 1, 2) @ at
    normals = sign[:, None] * np.eye(grid.dim)[axis]
    mass = 0.5 * (mass + np.swapaxes(mass, 1, 2))
    return joined_pieces([surface, Pieces(rows[region], beside, moments, mass, normals, beside)])


def _ends(table: CutTable, points: Array, grid: Grid, normal: Array, some: Indices) -> Array:
    """int L_q n over the ends of what is closed [m^(dim - 1)], n out of the fluid, shape (regions, points, dim).

    They have no facet, but int grad L_q over a region is int L_q n over all of its boundary.
    normal: of facets, out of the fluid; some: regions for which they are found, zero for others.
    """
    regions, dim, n = len(table.cell), grid.dim, len(points)
    shape, size = (n,) * dim, grid.cell_sizes()[table.cell]
    face = size.prod(axis=1)[:, None] / size
    found = np.zeros((regions, n**dim, dim))
    slopes = lagrange_slopes(points)  # of each polynomial at each point
    for axis in range(dim):
        by_axis = np.moveaxis(table.moments.reshape(regions, *shape), dim - axis, -1) @ slopes
        found[:, :, axis] = np.moveaxis(by_axis, -1, dim - axis).reshape(regions, n**dim) * face[:, axis, None]
        for side in (0, 1):
            at = np.flatnonzero((table.face_axis == axis) & (table.face_regions[:, 1 - side] >= 0))
            region = table.face_regions[at, 1 - side]
            on_face = table.face_moments[at].reshape(len(at), *shape[1:]) * face[region, axis].reshape(
                -1, *(1,) * (dim - 1)
            )
            outward = (2.0 * side - 1.0) * lagrange(points, np.array(float(side)))
            spread = np.moveaxis(np.multiply.outer(on_face, outward), -1, dim - axis).reshape(len(at), n**dim)
            np.subtract.at(found[:, :, axis], region, spread)
    measure = table.piece_moments.sum(axis=2)
    np.subtract.at(found, table.piece_region, measure[:, :, None] * normal[table.piece_facet][:, None, :])
    kept = np.zeros(regions, dtype=bool)
    kept[some] = True
    return np.where(kept[:, None, None], found, 0.0)


def _facets_beside(table: CutTable) -> Indices:
    """A facet for each region: that of a closed part in its cell, else one that bounds it."""
    found = np.zeros(len(table.cell), dtype=np.int64)
    found[table.piece_region[::-1]] = table.piece_facet[::-1]
    closed = np.full(len(table.state), -1)
    closed[table.closed_cell[::-1]] = table.closed_facet[::-1]
    return np.where(closed[table.cell] >= 0, closed[table.cell], found)


def _at_points(table: CutTable, points: Array, grid: Grid, corners: Array, region: Indices) -> Array:
    """Barycentric coordinates in facets of the points of the cells of regions, shape (facets, points, dim).

    Points are projected into the plane of the facet. corners: of facets [m], shape (facets, dim, dim).
    """
    low, size = place_of(grid, table.cell[region])
    tensor = np.stack(np.meshgrid(*[points] * grid.dim, indexing="ij"), axis=-1).reshape(-1, grid.dim)[:, ::-1]
    way = low[:, None] + size[:, None] * tensor - corners[:, :1]
    ways = corners[:, 1:] - corners[:, :1]
    gram = ways @ np.swapaxes(ways, 1, 2)
    found = np.swapaxes(np.linalg.solve(gram, ways @ np.swapaxes(way, 1, 2)), 1, 2)
    return np.concatenate([1.0 - found.sum(axis=2, keepdims=True), found], axis=2)
