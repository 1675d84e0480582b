"""Points in closed surfaces and their depth, against closed forms and the winding number."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.fluid.surfaces.inside import winding
from solvers.fluid.surfaces.surface import Motion
from solvers.mesh.penetration import depths, inside


def polygon(count, radius=1.0):
    angle = 2.0 * np.pi * np.arange(count) / count
    x = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return x[np.stack([np.arange(count), np.roll(np.arange(count), -1)], axis=1)]


def box(low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0)):
    corners = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
    x = np.array(low) + corners * (np.array(high) - np.array(low))
    quads = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return x[np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])]


def torus(around=24, across=12):
    u, v = np.meshgrid(2 * np.pi * np.arange(around) / around, 2 * np.pi * np.arange(across) / across, indexing="ij")
    x = np.stack([(1 + 0.4 * np.cos(v)) * np.cos(u), (1 + 0.4 * np.cos(v)) * np.sin(u), 0.4 * np.sin(v)], axis=-1)
    at = lambda i, j: x[i % around, j % across]  # noqa: E731
    quads = [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)) for i in range(around) for j in range(across)]
    return np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def turned(corners, seed):
    axes = np.linalg.qr(np.random.default_rng(seed).normal(size=(corners.shape[-1],) * 2))[0]
    axes[0] *= np.sign(np.linalg.det(axes))
    return corners @ axes.T


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("surface", [polygon(17), box(), torus()])
@pytest.mark.parametrize("seed", range(3))
def test_inside_is_where_the_surface_winds_once(surface, seed, scale):
    corners = scale * turned(surface, seed)
    dim = corners.shape[-1]
    flat = corners.reshape(-1, dim)
    points = np.random.default_rng(seed).uniform(flat.min(axis=0), flat.max(axis=0), size=(300, dim))
    facets = np.arange(len(flat)).reshape(-1, dim)
    turns = [winding(point, Motion(flat, flat), facets) for point in points]
    assert np.array_equal(inside(points, corners), np.array(turns) > 0.5)


@pytest.mark.parametrize("surface", [box(), torus(24, 12)])
def test_rays_through_vertices_and_edges_count_once(surface):
    """Points at the heights of vertices, where rays meet edges and corners of facets."""
    flat = surface.reshape(-1, 3)
    shifted = flat - np.array([10.0, 0.0, 0.0])
    assert not inside(shifted, surface).any()
    middle = flat.copy()
    middle[:, 0] = 0.5
    expected = (middle > 0.0).all(axis=1) & (middle < 1.0).all(axis=1)
    if len(surface) == 12:
        found = inside(middle, surface)
        on_surface = ((middle == 0.0) | (middle == 1.0)).any(axis=1)
        assert np.array_equal(found[~on_surface], expected[~on_surface])


def test_two_bodies_of_one_surface():
    """Disjoint parts, and one around the other: the union."""
    both = np.concatenate([polygon(12), polygon(12, 0.5), polygon(12) + np.array([5.0, 0.0])])
    points = np.array([[0.0, 0.0], [0.7, 0.0], [5.2, 0.1], [2.5, 0.0], [-2.0, 0.0]])
    assert inside(points, both).tolist() == [True, True, True, False, False]


def test_depth_below_the_nearest_side():
    points = np.array([[0.5, 0.5, 0.9], [0.2, 0.5, 0.6], [0.5, 0.5, 0.999]])
    found = depths(points, box(), np.array([0.01, 0.01, 0.01]))
    assert found == pytest.approx([0.1, 0.2, 0.0], abs=1e-14)
    square = np.array([[[0.0, 0], [1, 0]], [[1, 0], [1, 1]], [[1, 1], [0, 1]], [[0, 1], [0, 0]]])
    assert depths(np.array([[0.3, 0.9]]), square, np.zeros(1)) == pytest.approx([0.1], abs=1e-15)


def test_nothing_to_compare():
    assert inside(np.empty((0, 2)), polygon(5)).shape == (0,)
    assert not inside(np.zeros((2, 2)), np.empty((0, 2, 2))).any()
    assert depths(np.empty((0, 3)), box(), np.empty(0)).shape == (0,)
