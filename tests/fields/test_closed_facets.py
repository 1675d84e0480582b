"""Two bodies touch: in cells with fluid, what they cover of each other bounds none."""

import numpy as np
import pytest

from fsci.shapes import box, rectangle
from solvers import kernels
from solvers.fluid.geometry.closed_facets import without_closed
from solvers.fluid.geometry.pieces import NOTHING
from solvers.fluid.grid.box import FLUSH, uniform
from solvers.mesh.gauss import gauss
from solvers.mesh.tessellation import tessellate


def scene(dim: int, gap: float, *, scale: float = 1.0, shift: float = 0.0, turned: bool = False):
    """(facets of a block on a large plate, vertices, mask of the block's) in a box of 0 to 3, 0 to 2 (, 0 to 3)."""
    rest = [1.0] * (dim - 2)
    shape = rectangle if dim == 2 else box
    block = shape([1.0, 0.8, *rest], [7, 5, *[3] * (dim - 2)])
    # so long that the block lies on one of the two triangles of its upper side
    plate = shape([5.0, 0.4, *[20.0] * (dim - 2)], [1] * dim)
    (first, nodes), (second, others) = tessellate(block), tessellate(plate)
    x = block.points[nodes] + np.array([1.013 + shift, 0.55 + gap, *[0.77] * (dim - 2)])
    y = plate.points[others] + np.array([-1.0, 0.15, *[-1.0] * (dim - 2)])
    facets, points = np.concatenate([first, second + len(x)]), np.concatenate([x, y]) * scale
    if turned:
        points[:, 1] = 2.0 * scale - points[:, 1]
        facets = np.ascontiguousarray(facets[:, [1, 0, 2][:dim]])
    return facets, points, np.arange(len(facets)) < len(first)


def contact_side(dim, gap, *, scale=1.0, closing_block=True, turned=False, shift=0.0):
    """Of what faces along y in cells with fluid: (of the plate, of the block) area and first moment along x."""
    facets, x, of_block = scene(dim, gap, scale=scale, shift=shift, turned=turned)
    grid = uniform([0.0] * dim, (scale * np.array([3.0, 2.0, 3.0][:dim])).tolist(), [12, 10, 12][:dim])
    points = gauss(2)[0]
    moments = kernels.moments(grid.edges, points, x, facets, np.ones(grid.size, dtype=bool))
    closing = of_block if closing_block else ~of_block
    found = without_closed(moments, facets, x, closing, FLUSH * 0.2 * scale)
    corners = x[facets[found.piece_facet]]
    level = (2.0 - 0.55 if turned else 0.55) * scale
    at = (np.abs(corners[:, :, 1] - level) < 1e-3 * scale).all(axis=1)
    at &= found.fraction[found.cells[found.piece_cell]] < 1.0 - NOTHING
    areas, result = found.piece_moments.sum(axis=1), []
    for some in (at & ~of_block[found.piece_facet], at & of_block[found.piece_facet]):
        result += [areas[some].sum(), np.einsum("nv,nv->", areas[some], corners[some][:, :, 0])]
        assert found.piece_mass[some].sum() == pytest.approx(areas[some].sum(), abs=1e-12)
    return np.array(result)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    ("scale", "shift", "turned"), [(1, 0, False), (1e-3, 0, False), (1, 0.083, False), (1, 0, True)]
)
def test_what_touches_bounds_no_fluid(dim, scale, shift, turned):
    """The open part of the plate's upper side is what the block does not cover; the block's lower side is closed."""
    found = contact_side(dim, 0.0, scale=scale, shift=shift, turned=turned)
    width = scale ** (dim - 2)
    whole = 3.0 * scale * (3.0 * width if dim == 3 else 1.0)
    covered = scale * width
    middle = (1.513 + shift) * scale
    assert found == pytest.approx([whole - covered, 1.5 * scale * whole - middle * covered, 0, 0], abs=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_is_apart_bounds_fluid(dim):
    """A gap of 1e-5 cells is one: both sides of it count."""
    found = contact_side(dim, 2e-6)
    assert found[[0, 2]] == pytest.approx([3.0 ** (dim - 1), 1.0], abs=1e-9)


def test_a_plate_that_lies_on_smaller_facets_stays():
    """It is not on one of them: then the cell at the end of the contact counts as a whole, as before."""
    assert contact_side(2, 0.0, closing_block=False)[2] > 0.0
