"""Moments of surfaces in planes of the grid or beside them, that leave the box, touch, overlap, are thin or small."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from moments_setup import (
    all_cells,
    assert_consistent,
    assert_integrals,
    box,
    compute,
    corners_and_sizes,
    exact,
    gauss,
    identity_errors,
    moved,
    normals,
    shape,
    solid_weights,
    sphere,
    star,
    tensor,
    together,
    torus,
    uniform,
    weights,
)

from solvers.kernels import moments

UNIT = 0.25  # an exact number, so that these bodies lie in grid planes exactly


@pytest.mark.parametrize("dim", [2, 3])
def test_body_between_grid_planes(dim):
    """Cells inside are full, cells outside empty; every facet belongs to the cells outside, and to one cell only."""
    edges = [np.arange(-4, 5) * UNIT] * dim
    surface = box(dim * [-0.5], dim * [0.25])
    found = assert_integrals(edges, 3, surface)
    low, size = corners_and_sizes(edges, all_cells(edges))
    inside = ((low >= -0.5) & (low + size <= 0.25)).all(axis=1)
    np.testing.assert_allclose(found.fraction, inside, rtol=0, atol=1e-15)
    assert not inside[found.cells].any()
    assert len(found.cells) == 2 * dim * 3 ** (dim - 1)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("n", [3, 5])
def test_body_fills_the_box(dim, n):
    """Facets in the sides of the box that face outward belong to the cells inside."""
    edges = uniform(dim, 0, 1, 3)
    found = assert_integrals(edges, n, box(dim * [0.0], dim * [1.0]))
    np.testing.assert_allclose(found.fraction, 1, rtol=0, atol=1e-15)
    full = np.broadcast_to(tensor(*dim * [weights(n)]), found.solid.shape)
    np.testing.assert_allclose(found.solid, full, rtol=0, atol=1e-15)
    assert len(found.cells) == np.prod(shape(edges)) - np.prod([k - 2 for k in shape(edges)])


@pytest.mark.parametrize("dim", [2, 3])
def test_body_outside_touches_the_box(dim):
    """Seen from each side: no solid, but the side of the box is its surface and belongs to the cells there."""
    edges = uniform(dim, 0, 1, 3)
    for d, side in itertools.product(range(dim), (0, 1)):
        low, high = np.zeros(dim), np.ones(dim)
        low[d], high[d] = (1, 2) if side else (-1, 0)
        found = compute(edges, 3, box(low, high))
        np.testing.assert_allclose(found.fraction, 0, rtol=0, atol=1e-15)
        assert abs(found.piece_mass.sum() - 1) < 1e-14
        np.testing.assert_allclose(found.solid, 0, rtol=0, atol=1e-15)


@pytest.mark.parametrize("dim", [2, 3])
def test_body_covers_the_box(dim):
    edges = uniform(dim, 0, 1, 4)
    found = compute(edges, 3, box(dim * [-3.0], dim * [2.0]))
    np.testing.assert_allclose(found.fraction, 1, rtol=0, atol=1e-15)
    assert found.cells.size == found.piece_facet.size == 0
    assert found.solid.shape == (0, 3**dim)
    assert found.piece_moments.shape == (0, 3**dim, dim)


@pytest.mark.parametrize("dim", [2, 3])
def test_no_surface(dim):
    edges = uniform(dim, 0, 1, 2)
    found = moments(edges, gauss(2), np.zeros((0, dim)), np.zeros((0, dim), dtype=np.int64))
    np.testing.assert_array_equal(found.fraction, 0)
    assert found.piece_mass.shape == (0, dim, dim)


@pytest.mark.parametrize("dim", [2, 3])
def test_body_leaves_the_box(dim):
    """Through each side, edge and corner; and far away: the cells are the same as in a box that holds all of it."""
    small = uniform(dim, 0, 1, 3)
    wide = [np.concatenate([e[0] - [3, 2, 1, 0.5], e, e[-1] + [0.5, 1, 2, 3]]) for e in small]
    inner = np.ones(shape(wide)[::-1], dtype=bool)
    for axis in range(dim):
        index = np.arange(inner.shape[axis])
        keep = (index >= 4) & (index < inner.shape[axis] - 4)
        inner &= keep.reshape([-1 if a == axis else 1 for a in range(dim)])
    inner = np.flatnonzero(inner)
    rng = np.random.default_rng(0)
    body = star(9, 0.2, 0.45) if dim == 2 else torus(16, 9, 0.3, 0.15)
    for direction in itertools.product((-1, 0, 1), repeat=dim):
        for far in (0.5, 0.9, 1.5):
            vertices, facets = moved(body, rng)
            surface = vertices + 0.5 + far * np.array(direction), facets
            part, whole = compute(small, 3, surface), compute(wide, 3, surface)
            np.testing.assert_allclose(part.fraction, whole.fraction[inner], rtol=0, atol=1e-14)
            np.testing.assert_array_equal(inner[part.cells], np.intersect1d(whole.cells, inner))
            kept = np.isin(whole.cells, inner)
            np.testing.assert_allclose(part.solid, whole.solid[kept], rtol=0, atol=1e-14)
            pieces = kept[whole.piece_cell]
            np.testing.assert_array_equal(part.piece_facet, whole.piece_facet[pieces])
            np.testing.assert_allclose(part.piece_moments, whole.piece_moments[pieces], rtol=0, atol=1e-14)
            np.testing.assert_allclose(part.piece_mass, whole.piece_mass[pieces], rtol=0, atol=1e-14)
            assert_consistent(part, small, 3, surface)


# Several surfaces


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("place", [0.5, 0.4, 0.25 + 1e-13])
@pytest.mark.parametrize("overlap", [0.0, 1e-13, 1e-9, 0.01])
def test_two_bodies_touch_or_overlap(dim, place, overlap):
    """In a grid plane or not: each counts as if it were alone, also where both are."""
    edges = [np.arange(9) / 8] * dim
    for axis in range(dim):
        low, high = np.full(dim, 0.2), np.full(dim, 0.7)
        high[axis] = place
        left = box(low, high)
        low[axis], high[axis] = place - overlap, 0.9
        right = box(low, high)
        found = assert_integrals(edges, 3, together(left, right))
        alone = [compute(edges, 3, body) for body in (left, right)]
        np.testing.assert_allclose(found.fraction, sum(a.fraction for a in alone), rtol=0, atol=1e-14)
        assert len(found.piece_cell) == sum(len(a.piece_cell) for a in alone)
        assert abs(found.piece_mass.sum() - sum(a.piece_mass.sum() for a in alone)) < 1e-13
        assert identity_errors(found, edges, 3, together(left, right)).max() < 1e-13


@pytest.mark.parametrize("thickness", [0.05, 1e-3, 1e-9, 1e-13])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_body_thinner_than_a_cell(axis, thickness):
    """Both sides of a plate lie in the same cells; its volume is exact to the rounding of what both cut off."""
    low, high = np.full(3, -0.6), np.full(3, 0.6)
    low[axis] = 0.05
    high[axis] = 0.05 + thickness
    edges, surface = uniform(3, -1, 1, 5), box(low, high)
    found = compute(edges, 3, surface)
    assert_consistent(found, edges, 3, surface)
    both = np.abs(normals(surface)[0][found.piece_facet, axis]) == 1
    upper = normals(surface)[0][found.piece_facet, axis] == 1
    np.testing.assert_array_equal(np.unique(found.piece_cell[both & upper]), np.unique(found.piece_cell[both & ~upper]))
    volume = solid_weights(found, edges, 3)
    assert abs(volume.sum() - 1.2**2 * (high[axis] - low[axis])) < 1e-15
    assert volume[found.cells].sum(axis=1).max() > 0
    assert identity_errors(found, edges, 3, surface).max() < 1e-14


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("size", [0.3, 1e-3, 1e-6, 1e-9])
def test_body_inside_one_cell(dim, size):
    """However small: its volume is exact to the rounding of its corners."""
    rng = np.random.default_rng(0)
    vertices, facets = moved(star(5, 0.2, 0.4) if dim == 2 else sphere(0.5, 1), rng)
    surface = (vertices * size + 0.5, facets)
    edges = [np.arange(-2.0, 3.0)] * dim
    found = compute(edges, 3, surface)
    assert len(found.cells) == 1
    volume = exact((surface[0] - 0.5, facets))[0]
    assert abs(found.solid.sum() - volume) < 1e-15 * size ** (dim - 1)
    np.testing.assert_allclose(np.delete(found.fraction, found.cells), 0, rtol=0, atol=1e-15 * size ** (dim - 1))
    np.testing.assert_allclose(found.piece_mass.sum(axis=(1, 2)), normals(surface)[1], rtol=1e-12)
    np.testing.assert_allclose(found.piece_mass[:, 0, 1] / found.piece_mass[:, 0, 0], 0.5, rtol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_slivers_keep_their_relative_accuracy(dim):
    """A side 1e-12 h behind a grid plane through 0: that volume is as exact as its corners."""
    edges = [np.arange(-2, 3) * 0.25] * dim
    for axis in range(dim):
        low, high = np.full(dim, -0.3), np.full(dim, 0.3)
        high[axis] = 0.25e-12
        found = compute(edges, 4, box(low, high))
        size = corners_and_sizes(edges, all_cells(edges))[0]
        above = (size[found.cells, axis] == 0) & (np.delete(size[found.cells], axis, axis=1) == 0).all(axis=1)
        assert above.sum() == 1
        expected = 1e-12 * tensor(*(lagrange_at_zero(4) if d == axis else weights(4) for d in range(dim)))
        np.testing.assert_allclose(found.solid[above][0], expected, rtol=1e-10, atol=0)


def lagrange_at_zero(n: int) -> np.ndarray:
    """Of a function over a layer at the left end only its value there is seen."""
    x = gauss(n)
    return np.array([np.prod([-b / (a - b) for b in x if b != a]) for a in x])
