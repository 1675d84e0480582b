"""Pieces of surface in a plane of the grid belong to the cell with the fluid, whatever rounding says."""

import numpy as np
import pytest
from fluid_setup import block

from solvers import kernels
from solvers.fluid.geometry.pieces import put_where_fluid_is
from solvers.fluid.grid.box import uniform
from solvers.mesh.tessellation import unit_normals


def pieces(dim, points, low, high):
    """(cell, facet, moments) of the pieces of a block that bound fluid and are no slivers, sorted."""
    grid = uniform([0] * dim, [1] * dim, [4] * dim)
    x, facets = block(low, high)
    found = kernels.moments(grid.edges, points, x, facets, np.ones(grid.size, dtype=bool))
    normal = -unit_normals(x[facets])[found.piece_facet]
    cell, moments = put_where_fluid_is(grid, points, found, normal, found.fraction >= 1 - 1e-10)
    order = np.lexsort((found.piece_facet, cell))
    order = order[(cell[order] >= 0) & (found.piece_mass[order].sum(axis=(1, 2)) > 1e-10)]
    return cell[order], found.piece_facet[order], moments[order]


@pytest.mark.parametrize("count", [3, 5])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("off", [1e-13, -1e-13])
def test_block_beside_planes(dim, count, off):
    """Its faces are off by rounding, or in the planes exactly, where the kernel itself chooses the fluid's side."""
    points = np.polynomial.legendre.leggauss(count)[0] / 2 + 0.5
    low, high = np.array([0.25, 0.5, 0.25][:dim]), np.array([0.75, 0.75, 1.0][:dim])
    exact, beside = pieces(dim, points, low, high), pieces(dim, points, low + off, high - off)
    for one, other in zip(exact, beside, strict=True):
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-11)
