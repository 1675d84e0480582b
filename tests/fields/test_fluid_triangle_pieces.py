"""Pieces of surface that are triangles in cells of several sizes: as the kernel of moments integrates them."""

import numpy as np

from solvers import kernels
from solvers.fluid.geometry.pieces import place_of
from solvers.fluid.geometry.triangle_pieces import TRIANGLES_AT_ONCE, parts_of_triangles
from solvers.fluid.grid.box import Grid
from solvers.mesh.gauss import gauss


def test_whole_triangles():
    """One or more triangles within each cell of a graded grid: moments, masses and normals; more than one chunk."""
    rng, points = np.random.default_rng(3), gauss(3)[0]
    grid = Grid(tuple(np.cumsum(rng.uniform(0.2, 1.0, count + 1)) for count in (5, 4, 3)))
    cell = np.repeat(np.arange(grid.size), TRIANGLES_AT_ONCE // grid.size + 2)
    low, size = place_of(grid, cell)
    corners = rng.uniform(0.1, 0.9, (len(cell), 3, 3))
    x = (low[:, None] + corners * size[:, None]).reshape(-1, 3)
    facets = np.arange(len(x)).reshape(-1, 3)
    moments = kernels.moments(grid.edges, points, x, facets, np.ones(grid.size, dtype=bool))
    order = np.argsort(moments.piece_facet)
    assert np.array_equal(moments.piece_facet[order], np.arange(len(cell)))
    rows = rng.integers(0, 100, len(cell))
    parts = np.column_stack([np.arange(len(cell)), corners.reshape(-1, 9)])
    found = parts_of_triangles(grid, cell, rows, parts, facets, x, points)
    assert np.array_equal(found.cell, rows)
    assert np.array_equal(found.facet, np.arange(len(cell)))
    assert np.abs(found.moments - moments.piece_moments[order]).max() < 1e-13
    assert np.abs(found.mass - moments.piece_mass[order]).max() < 1e-13
    ways = x[facets][:, 1:] - x[facets][:, :1]
    assert np.abs(np.einsum("pd,pkd->pk", found.normal, ways)).max() < 1e-14
    assert np.abs(np.linalg.norm(found.normal, axis=1) - 1.0).max() < 1e-14


def test_half_of_a_triangle():
    """Its mean barycentric coordinates are those of its own middle in the facet."""
    points = gauss(3)[0]
    grid = Grid((np.array([0.0, 2.0]), np.array([0.0, 1.0]), np.array([0.0, 0.5])))
    x = np.array([[0.2, 0.1, 0.1], [1.8, 0.3, 0.1], [0.4, 0.8, 0.4]])
    half = np.array([x[0], x[1], 0.5 * (x[0] + x[2])]) / [2.0, 1.0, 0.5]
    parts = np.concatenate([[0.0], half.ravel()])[None]
    zero = np.zeros(1, dtype=np.int64)
    found = parts_of_triangles(grid, zero, zero, parts, np.array([[0, 1, 2]]), x, points)
    area = 0.25 * np.linalg.norm(np.cross(x[1] - x[0], x[2] - x[0]))
    assert np.abs(found.moments.sum(axis=1)[0] / area - [0.5, 1.0 / 3.0, 1.0 / 6.0]).max() < 1e-13
