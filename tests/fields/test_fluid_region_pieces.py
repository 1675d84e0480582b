"""Pieces of surface of the regions of a table: as the kernel of moments integrates them."""

import numpy as np
import pytest
from fluid_setup import circle, loop, sphere

from solvers import kernels
from solvers.cut_cells import ClosedSurfaces, cut_cells
from solvers.fluid.geometry.regions import pieces_of_regions
from solvers.fluid.grid.box import Grid
from solvers.mesh.gauss import gauss


@pytest.mark.parametrize(("dim", "count"), [(2, 3), (2, 5), (2, 7), (3, 3), (3, 5)])
def test_pieces_of_one_body(dim, count):
    """In a graded grid, with facets larger and smaller than cells: moments, masses and normals."""
    rng, points = np.random.default_rng(3), gauss(count)[0]
    grid = Grid(tuple(np.cumsum(rng.uniform(0.2, 1.0, cells + 1)) for cells in (5, 4, 3)[:dim]))
    for sides in (2, 4):
        if dim == 2:
            x, facets = circle((1.7, 1.4), 0.9, 3**sides), loop(3**sides)
        else:
            x, facets = sphere((1.7, 1.4, 1.2), 0.9, sides - 1)
        moments = kernels.moments(grid.edges, points, x, facets, np.ones(grid.size, dtype=bool))
        table = cut_cells(grid.edges, points, ClosedSurfaces(facets, np.zeros(len(facets), dtype=int)), x)
        found = pieces_of_regions(table, points, grid, facets, x, table.cell)
        keys = found.cell * len(facets) + found.facet
        order = np.argsort(keys)
        assert np.array_equal(keys[order], moments.cells[moments.piece_cell] * len(facets) + moments.piece_facet)
        assert np.abs(found.moments[order] - moments.piece_moments).max() < 1e-13
        assert np.abs(found.mass[order] - moments.piece_mass).max() < 1e-13
        ways = x[facets[found.facet]][:, 1:] - x[facets[found.facet]][:, :1]
        assert np.abs(np.einsum("pd,pkd->pk", found.normal, ways)).max() < 1e-13
        assert np.abs(np.linalg.norm(found.normal, axis=1) - 1.0).max() < 1e-14
