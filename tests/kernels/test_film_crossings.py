"""Lines along which facets cross planes of the grid: what they add to the derivative of moments by a translation."""

import numpy as np
import pytest
from moments_setup import all_cells, box, corners_and_sizes, graded, moved, sphere, star, tensor

from solvers.fluid.terms.shape_derivatives.film_crossings import crossing_moments
from solvers.kernels import moments
from solvers.mesh.gauss import gauss
from solvers.mesh.tessellation import unit_normals

STEP = 1e-6
BODIES = {
    "disc": star(24, 0.6, 0.6),
    "square": box([-0.4, -0.4], [0.4, 0.4]),
    "sphere": sphere(0.6, 2),
    "cube": box([-0.4, -0.4, -0.4], [0.4, 0.4, 0.4]),
}


def moments_of(edges, points, x, facets):
    """Moments (points, vertices) of each piece by its cell and facet."""
    found = moments(edges, points, x, facets, np.ones(len(all_cells(edges)), dtype=bool))
    cells = found.cells[found.piece_cell]
    return dict(zip(zip(cells, found.piece_facet, strict=True), found.piece_moments, strict=True))


@pytest.mark.parametrize("points", [3, 5])
@pytest.mark.parametrize("name", BODIES)
def test_derivative_of_moments_by_a_translation(name, points):
    """d int f lambda = int grad f . d lambda - int_line f lambda e . d / s, for f of degree 2 in each direction."""
    x, facets = moved(BODIES[name], np.random.default_rng(5))
    dim, rng = x.shape[1], np.random.default_rng(1)
    edges, at, way = graded(dim, -1, 1, 5), gauss(points)[0], rng.normal(size=dim)
    now, *moves = (moments_of(edges, at, x + h * way, facets) for h in (0.0, STEP, -STEP))
    pieces = [key for key in now if all(key in after for after in moves)]
    cell, facet = (np.array(column) for column in zip(*pieces, strict=True))
    origin, sizes = corners_and_sizes(edges, cell)
    ones = [np.ones(points)] * dim
    reference = np.stack([tensor(*[at if k == axis else ones[k] for k in range(dim)]) for axis in range(dim)], axis=1)
    corners, normals = x[facets[facet]], -unit_normals(x[facets])[facet]
    sides = np.ones((len(pieces), dim, 2), dtype=bool)
    lines = crossing_moments(corners, normals, origin, sizes, reference, sides)
    a, b = rng.normal(size=(2, dim))
    value = (1.0 + reference @ a) * (1.0 + reference @ b)
    slope = (a * (1.0 + reference @ b)[:, None] + b * (1.0 + reference @ a)[:, None])[None] / sizes[:, None]
    M = np.stack([now[key] for key in pieces])
    exact = np.stack([moves[0][key] - moves[1][key] for key in pieces]) / (2.0 * STEP)
    exact = np.einsum("nqv,q->nv", exact, value)
    inside = np.einsum("nqv,nqj,j->nv", M, slope, way)
    found = inside - np.einsum("nvqj,q,j->nv", lines, value, way)
    size = np.abs(exact).max()
    assert np.abs(inside - exact).max() > 0.1 * size
    assert np.abs(found - exact).max() < 1e-6 * size


def test_facet_that_is_nearly_in_the_plane():
    """Its slope s is known to rounding: the weights of a point on the plane add up to 1 / s."""
    slope, at = 7e-6, gauss(3)[0]
    x = np.array([[[0.2, -0.3 * slope], [0.8, 0.3 * slope]]])
    normal = np.array([[-slope, 1.0]]) / np.hypot(slope, 1.0)
    reference = np.stack([tensor(at, np.ones(3)), tensor(np.ones(3), at)], axis=1)
    sides = np.ones((1, 2, 2), dtype=bool)
    lines = crossing_moments(x, normal, np.zeros((1, 2)), np.ones((1, 2)), reference, sides)
    assert lines[..., 1].sum() == pytest.approx(-1.0 / slope, rel=1e-9)
    assert not lines[..., 0].any()


@pytest.mark.parametrize(
    "corners",
    [
        [[0.5, 1.2, 0.1], [0.5, -1e-20, 0.1], [0.5, -6e-7, 0.9]],
        [[0.5, -3e-6, 0.1], [0.9, 3e-6, 0.1], [0.5, 3e-6, 0.9]],
    ],
)
def test_end_of_what_is_closed_crosses_no_plane(corners):
    """Its normal is an axis, not that of the facet beside it: with it, the slope s of that facet was zero."""
    x = np.array([corners])
    at, ones = gauss(3)[0], np.ones(3)
    reference = np.stack([tensor(*[at if k == axis else ones for k in range(3)]) for axis in range(3)], axis=1)
    sides, cell = np.ones((1, 3, 2), dtype=bool), (np.zeros((1, 3)), np.ones((1, 3)))
    assert crossing_moments(x, unit_normals(x), *cell, reference, sides)[..., 1].any()
    assert not crossing_moments(x, np.array([[0.0, 1.0, 0.0]]), *cell, reference, sides).any()
