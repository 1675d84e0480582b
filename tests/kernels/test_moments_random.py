"""Moments of random cuts, with corners in nodes, edges and faces of the grid or just beside them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from moments_setup import (
    Surface,
    all_cells,
    box,
    compute,
    corners_and_sizes,
    identity_errors,
    normals,
    simplex,
)

#: Where a corner may lie relative to a cell [0, 1]: anywhere, on its faces, and beside them.
PLACES = np.array([0.0, 0.0, 1.0, 1.0, 1e-9, -1e-9, 1 - 1e-9, 1 + 1e-9, 1e-13, -1e-13, 1 - 1e-13, 1 + 1e-13])


def snapped(rng: np.random.Generator, size: tuple[int, ...], share: float) -> np.ndarray:
    """Random coordinates, some of them at PLACES."""
    x = rng.uniform(-0.9, 1.9, size)
    at = rng.random(size) < share
    x[at] = rng.choice(PLACES, at.sum())
    return x


def blocks(dim: int, side: int) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Grid of side^dim blocks of 3^dim unit cells; the origins of their middle cells; the block of each cell."""
    edges = [np.arange(3.0 * side + 1)] * dim
    low, _ = corners_and_sizes(edges, all_cells(edges))
    block = (low // 3).astype(int) @ side ** np.arange(dim)
    origin = np.stack(np.meshgrid(*dim * [np.arange(side)], indexing="ij"), axis=-1).reshape(-1, dim)[:, ::-1]
    return edges, 3.0 * origin + 1, block


def assert_many(dim: int, side: int, n: int, vertices: np.ndarray, facets: np.ndarray) -> None:
    """Bodies (side^dim, corners, dim), each around the cell [0, 1]^dim and put into its own block."""
    edges, origin, block = blocks(dim, side)
    placed = vertices + origin[:, None]
    count, corners = vertices.shape[:2]
    surface = (
        placed.reshape(-1, dim),
        (facets[None] + corners * np.arange(count)[:, None, None]).reshape(-1, dim),
    )
    found = compute(edges, n, surface)
    local = placed - origin[:, None]  # exact: what is left of the corners after rounding
    volume = (np.linalg.det(local[:, facets]) / (2 if dim == 2 else 6)).sum(axis=1)
    rounding = 10 * np.spacing(3.0 * side)  # of the points of the cuts
    np.testing.assert_allclose(np.bincount(block, found.fraction), volume, rtol=0, atol=rounding)
    area = normals(surface)[1]
    by_facet = np.bincount(found.piece_facet, found.piece_mass.sum(axis=(1, 2)), len(area))
    np.testing.assert_allclose(by_facet, area, rtol=0, atol=rounding)
    assert identity_errors(found, edges, n, surface).max() < 1e-12
    assert found.solid.sum(axis=1).min() > -rounding
    assert found.solid.sum(axis=1).max() < 1 + rounding


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_random_tetrahedra(share, seed):
    side = 21
    rng = np.random.default_rng([int(10 * share), seed])
    vertices = snapped(rng, (side**3, 4, 3), share)
    flip = np.linalg.det(vertices[:, 1:] - vertices[:, :1]) < 0
    vertices[flip, :2] = vertices[flip, 1::-1]
    assert_many(3, side, 3, vertices, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_random_boxes(share):
    side = 12
    rng = np.random.default_rng(int(10 * share))
    ends = np.sort(snapped(rng, (side**3, 2, 3), share), axis=1)
    vertices = np.stack([box(low, high)[0] for low, high in ends])
    assert_many(3, side, 3, vertices, box([0, 0, 0], [1, 1, 1])[1])


@pytest.mark.parametrize("n", [3, 5])
@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_random_triangles_in_2d(share, n):
    side = 80
    rng = np.random.default_rng([int(10 * share), n])
    vertices = snapped(rng, (side**2, 3, 2), share)
    flip = np.linalg.det(vertices[:, 1:] - vertices[:, :1]) < 0
    vertices[flip, :2] = vertices[flip, 1::-1]
    assert_many(2, side, n, vertices, np.array([[0, 1], [1, 2], [2, 0]]))


def half_space(normal: np.ndarray, point: np.ndarray) -> Surface:
    """A tetrahedron that is the half space behind a plane as far as the unit cube can see."""
    normal = normal / np.linalg.norm(normal)
    first = np.eye(3)[np.abs(normal).argmin()]
    first = np.cross(normal, first)
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    base = [point + 40 * (np.cos(t) * first + np.sin(t) * second) for t in 2 * np.pi * np.arange(3) / 3]
    return simplex([*base, point - 20 * normal])


def cut_cube(normal: np.ndarray, height: float) -> float:
    """Volume of the unit cube where normal.x <= height, all entries of normal positive: inclusion, exclusion."""
    corners = np.array(list(itertools.product((0, 1), repeat=3)))
    terms = np.maximum(0, height - corners @ normal) ** 3 * (-1.0) ** corners.sum(axis=1)
    return terms.sum() / (6 * normal.prod())


def test_random_planes_through_one_cell():
    rng = np.random.default_rng(0)
    edges = [np.array([0.0, 1.0])] * 3
    for _ in range(1200):
        normal, point = rng.uniform(0.1, 1, 3) * rng.choice([-1, 1], 3), rng.random(3)
        surface = half_space(normal, point)
        found = compute(edges, 3, surface)
        # the mirror image in the planes x_d = 1/2 has a normal with positive entries
        mirrored = np.where(normal < 0, 1 - point, point)
        assert abs(found.fraction[0] - cut_cube(np.abs(normal), np.abs(normal) @ mirrored)) < 1e-12
        assert identity_errors(found, edges, 3, surface).max() < 1e-12


def test_planes_through_nodes_edges_and_faces():
    """Planes through three of 27 points: corners and middles of the cube, its edges and its faces."""
    edges = [np.array([0.0, 1.0])] * 3
    places = np.array(list(itertools.product((0, 0.5, 1), repeat=3)))
    rng = np.random.default_rng(0)
    for chosen in itertools.combinations(range(27), 3):
        a, b, c = places[list(chosen)]
        normal = np.cross(b - a, c - a)
        if not normal.any() or rng.random() < 0.5:
            continue
        behind, ahead = half_space(normal, a), half_space(-normal, a)
        one, other = compute(edges, 3, behind), compute(edges, 3, ahead)
        assert abs(one.fraction[0] + other.fraction[0] - 1) < 1e-13
        for found, surface in ((one, behind), (other, ahead)):
            if len(found.cells):
                assert identity_errors(found, edges, 3, surface).max() < 1e-12
