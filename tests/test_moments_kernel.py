"""Moments of a solid in the cells of a box grid: exact to rounding, wherever its surface lies."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

from solvers.kernels import Moments, moments

Surface = tuple[np.ndarray, np.ndarray]  # vertices, facets


def gauss(n: int) -> np.ndarray:
    return (np.polynomial.legendre.leggauss(n)[0] + 1) / 2


def weights(n: int) -> np.ndarray:
    return np.polynomial.legendre.leggauss(n)[1] / 2


def tensor(*factors: np.ndarray) -> np.ndarray:
    """Product of functions of x, y(, z), numbered with x fastest, as the kernel does."""
    product = np.ones(1)
    for factor in factors:
        product = np.multiply.outer(factor, product).ravel()
    return product


# Grids


def uniform(dim: int, low: float, high: float, cells: int) -> list[np.ndarray]:
    return [np.linspace(low, high, cells + d + 1) for d in range(dim)]


def graded(dim: int, low: float, high: float, cells: int) -> list[np.ndarray]:
    """Cells of the middle about seven times smaller than those at the ends."""
    s = [np.linspace(-1, 1, cells + d + 1) for d in range(dim)]
    return [low + (high - low) * ((0.15 * t + 0.85 * t**3) + 1) / 2 for t in s]


def shape(edges: Sequence[np.ndarray]) -> list[int]:
    return [len(e) - 1 for e in edges]


def corners_and_sizes(edges: Sequence[np.ndarray], cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower corners and sizes of cells, (C, dim) each."""
    index = np.unravel_index(cells, shape(edges)[::-1])[::-1]
    low = np.stack([e[i] for e, i in zip(edges, index, strict=True)], axis=-1)
    size = np.stack([e[i + 1] - e[i] for e, i in zip(edges, index, strict=True)], axis=-1)
    return low, size


def all_cells(edges: Sequence[np.ndarray]) -> np.ndarray:
    return np.arange(np.prod(shape(edges)))


# Surfaces


def simplex(vertices: np.ndarray) -> Surface:
    """A tetrahedron or triangle, turned so that its normals point outward."""
    vertices = np.array(vertices, dtype=float)
    dim = vertices.shape[1]
    if np.linalg.det(vertices[1:] - vertices[0]) < 0:
        vertices[[0, 1]] = vertices[[1, 0]]
    facets = [[0, 1], [1, 2], [2, 0]] if dim == 2 else [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    return vertices, np.array(facets)


def box(low: Sequence[float], high: Sequence[float]) -> Surface:
    if len(low) == 2:
        return polygon([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    vertices = np.array(list(itertools.product(*zip(low, high, strict=True))), dtype=float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return vertices, np.array([[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)])


def sphere(radius: float, refinements: int) -> Surface:
    """An octahedron, refined."""
    eye = np.eye(3)
    vertices = np.concatenate([eye, -eye])
    facets = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    for _ in range(refinements):
        sides = np.sort(np.concatenate([facets[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
        unique, inverse = np.unique(sides, axis=0, return_inverse=True)
        m = len(vertices) + inverse.reshape(3, -1)
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
        a, b, c = facets.T
        pieces = [(a, m[0], m[2]), (m[0], b, m[1]), (m[2], m[1], c), (m[0], m[1], m[2])]
        facets = np.concatenate([np.stack(piece, axis=1) for piece in pieces])
    return radius * vertices, facets


def torus(around: int, across: int, major: float = 0.5, minor: float = 0.2) -> Surface:
    u, v = np.meshgrid(*(2 * np.pi * np.arange(n) / n for n in (around, across)), indexing="ij")
    ring = major + minor * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), minor * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    a, b = i * across + j, (i + 1) % around * across + j
    c, d = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
    return vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def polygon(vertices: np.ndarray | list) -> Surface:
    """A 2D body, its corners counter-clockwise."""
    number = np.arange(len(vertices))
    return np.array(vertices, dtype=float), np.stack([number, np.roll(number, -1)], axis=1)


def star(spikes: int, inner: float, outer: float) -> Surface:
    angle = np.pi * np.arange(2 * spikes) / spikes
    radius = np.where(np.arange(2 * spikes) % 2, inner, outer)
    return polygon(np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1))


def rotation(rng: np.random.Generator, dim: int) -> np.ndarray:
    q = np.linalg.qr(rng.standard_normal((dim, dim)))[0]
    q[:, 0] *= np.sign(np.linalg.det(q))
    return q


def moved(surface: Surface, rng: np.random.Generator, shift: float = 0.1) -> Surface:
    """Turned at random and shifted by a little."""
    vertices, facets = surface
    dim = vertices.shape[1]
    return vertices @ rotation(rng, dim).T + rng.uniform(-shift, shift, dim), facets


def together(*surfaces: Surface) -> Surface:
    first = np.cumsum([0, *(len(vertices) for vertices, _ in surfaces)])
    vertices = np.concatenate([vertices for vertices, _ in surfaces])
    return vertices, np.concatenate([facets + n for (_, facets), n in zip(surfaces, first, strict=False)])


def normals(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals and areas of the facets."""
    x = surface[0][surface[1]]
    if x.shape[2] == 2:
        d = x[:, 1] - x[:, 0]
        vector = np.stack([d[:, 1], -d[:, 0]], axis=1)
    else:
        vector = 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    area = np.linalg.norm(vector, axis=1)
    return vector / np.where(area == 0, 1, area)[:, None], area


def exact(surface: Surface) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, first and second moments: sums over the simplices between the facets and the origin."""
    x = surface[0][surface[1]]
    dim = x.shape[2]
    volume = np.linalg.det(x) / (2 if dim == 2 else 6)
    sums = x.sum(axis=1)
    second = np.einsum("tvi,tvj->tij", x, x) + np.einsum("ti,tj->tij", sums, sums)
    return (
        volume.sum(),
        volume @ sums / (dim + 1),
        np.einsum("t,tij->ij", volume, second) / ((dim + 1) * (dim + 2)),
    )


# What the kernel gives, summed and checked


def compute(edges: Sequence[np.ndarray], n: int, surface: Surface, wanted: np.ndarray | None = None) -> Moments:
    return moments(edges, gauss(n), *surface, wanted)


def solid_weights(found: Moments, edges: Sequence[np.ndarray], n: int) -> np.ndarray:
    """Integrals of L_q over the solid in every cell, (cells, n^dim)."""
    dim = len(edges)
    values = found.fraction[:, None] * tensor(*dim * [weights(n)])
    values[found.cells] = found.solid
    return values * corners_and_sizes(edges, all_cells(edges))[1].prod(axis=1)[:, None]


def points_of(edges: Sequence[np.ndarray], n: int, cells: np.ndarray) -> np.ndarray:
    """The tensor points of cells, (C, n^dim, dim)."""
    low, size = corners_and_sizes(edges, cells)
    dim = len(edges)
    one = np.ones(n)
    local = np.stack([tensor(*(gauss(n) if e == d else one for e in range(dim))) for d in range(dim)], axis=-1)
    return low[:, None] + size[:, None] * local


def assert_integrals(edges: Sequence[np.ndarray], n: int, surface: Surface, tolerance: float = 1e-13) -> Moments:
    """Volume, moments and areas of a surface within the box are those of its facets."""
    found = compute(edges, n, surface)
    dim = len(edges)
    volume, first, second = exact(surface)
    size = np.ptp(surface[0], axis=0).max() + np.abs(surface[0]).max()
    values, x = solid_weights(found, edges, n), points_of(edges, n, all_cells(edges))
    assert abs(values.sum() - volume) <= tolerance * volume
    assert abs(found.fraction @ corners_and_sizes(edges, all_cells(edges))[1].prod(axis=1) - volume) <= (
        tolerance * volume
    )
    np.testing.assert_allclose(np.einsum("cq,cqi->i", values, x), first, rtol=0, atol=tolerance * volume * size)
    here = np.einsum("cq,cqi,cqj->ij", values, x, x)
    known = ~np.eye(dim, dtype=bool) | (n > 2)  # x^2 is not in the space of two points
    np.testing.assert_allclose(here[known], second[known], rtol=0, atol=tolerance * volume * size**2)

    normal, area = normals(surface)
    by_facet = np.bincount(found.piece_facet, found.piece_mass.sum(axis=(1, 2)), len(surface[1]))
    np.testing.assert_allclose(by_facet, area, rtol=0, atol=tolerance * area.max())
    assert np.abs(by_facet @ normal).max() < tolerance * area.sum()
    assert_consistent(found, edges, n, surface, tolerance)
    return found


def assert_consistent(
    found: Moments, edges: Sequence[np.ndarray], n: int, surface: Surface, tolerance: float = 1e-13
) -> None:
    """Shapes, order, partitions of unity, and the first moments of every piece."""
    dim, size, pieces = len(edges), n ** len(edges), len(found.piece_cell)
    assert found.fraction.shape == (np.prod(shape(edges)),)
    assert found.solid.shape == (len(found.cells), size)
    assert found.piece_facet.shape == (pieces,)
    assert found.piece_moments.shape == (pieces, size, dim)
    assert found.piece_mass.shape == (pieces, dim, dim)
    assert (np.diff(found.cells) > 0).all()
    np.testing.assert_array_equal(np.unique(found.piece_cell), np.arange(len(found.cells)))
    order = found.piece_cell * len(surface[1]) + found.piece_facet
    assert (np.diff(order) > 0).all()
    assert (found.piece_mass.sum(axis=(1, 2)) > 0).all()

    # sum over q of L_q and over v of lambda_v are 1, sum over q of x_q L_q is x
    area = normals(surface)[1].max()
    np.testing.assert_allclose(
        found.piece_moments.sum(axis=1), found.piece_mass.sum(axis=1), rtol=0, atol=tolerance * area
    )
    x = points_of(edges, n, found.cells)[found.piece_cell]
    corner = surface[0][surface[1][found.piece_facet]]
    scale = area * np.abs(surface[0]).max()
    position = np.einsum("pqv,pqi->pvi", found.piece_moments, x)
    np.testing.assert_allclose(
        position, np.einsum("pvw,pwi->pvi", found.piece_mass, corner), rtol=0, atol=tolerance * scale
    )
    np.testing.assert_allclose(found.fraction[found.cells], found.solid.sum(axis=1), rtol=0, atol=1e-14)


def identity_errors(found: Moments, edges: Sequence[np.ndarray], n: int, surface: Surface) -> np.ndarray:
    """|integral of div F - integral of F.n| / the area of a face, by cell and direction, for fields F with entries
    of order 1 that do not flow through the faces of the cell: F_d = u(x_d) r(others), u zero at both ends.
    """
    _, size = corners_and_sizes(edges, found.cells)
    normal = normals(surface)[0][found.piece_facet]
    surface_moments = found.piece_moments.sum(axis=2)
    errors = []
    for d, (field, slope) in enumerate(closed_fields(len(edges), n)):
        volume = found.solid @ slope * size.prod(axis=1) / size[:, d]
        flux = np.bincount(found.piece_cell, normal[:, d] * (surface_moments @ field), len(found.cells))
        errors.append((volume - flux) / (size.prod(axis=1) / size[:, d]))
    return np.abs(np.stack(errors, axis=-1))


@cache
def closed_fields(dim: int, n: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """F_d and its derivative along d at the tensor points of the unit cell."""
    rng = np.random.default_rng(0)
    x = gauss(n)
    bubble = np.polynomial.Polynomial([0, 4, -4]) * np.polynomial.Polynomial(rng.uniform(-1, 1, n - 2))
    fields = []
    for d in range(dim):
        other = [rng.uniform(-1, 1, n) for _ in range(dim)]
        along = [[function(x) if e == d else other[e] for e in range(dim)] for function in (bubble, bubble.deriv())]
        fields.append((tensor(*along[0]), tensor(*along[1])))
    return fields


# Known bodies

BODIES_3D = {
    "cube": lambda: box([-0.4, -0.4, -0.4], [0.4, 0.4, 0.4]),
    "tetrahedron": lambda: simplex([[-0.5, -0.4, -0.3], [0.6, -0.4, -0.3], [0, 0.5, -0.3], [0, 0, 0.6]]),
    "sphere": lambda: sphere(0.6, 3),
    "torus": lambda: torus(40, 20),
}
BODIES_2D = {
    "square": lambda: box([-0.4, -0.4], [0.4, 0.4]),
    "disc": lambda: star(50, 0.6, 0.6),
    "star": lambda: star(7, 0.15, 0.7),
}
GRIDS = {"uniform": uniform, "graded": graded}


@pytest.mark.parametrize("n", [2, 3, 4, 5])
@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("body", BODIES_3D)
def test_integrals_3d(body, grid, n):
    edges = GRIDS[grid](3, -1, 1, 7)
    for seed in range(3):
        surface = moved(BODIES_3D[body](), np.random.default_rng(seed))
        found = assert_integrals(edges, n, surface)
        uncut = np.delete(found.fraction, found.cells)
        assert np.minimum(np.abs(uncut), np.abs(uncut - 1)).max() < 1e-14
        if n > 2:
            assert identity_errors(found, edges, n, surface).max() < 1e-13


@pytest.mark.parametrize("n", [2, 3, 4, 5])
@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("body", BODIES_2D)
def test_integrals_2d(body, grid, n):
    edges = GRIDS[grid](2, -1, 1, 13)
    for seed in range(5):
        surface = moved(BODIES_2D[body](), np.random.default_rng(seed))
        found = assert_integrals(edges, n, surface)
        uncut = np.delete(found.fraction, found.cells)
        assert np.minimum(np.abs(uncut), np.abs(uncut - 1)).max() < 1e-14
        if n > 2:
            assert identity_errors(found, edges, n, surface).max() < 1e-13


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_fluid_and_solid_fill_the_box(n):
    """The same surface inside out is the hole it leaves: both together are the box."""
    edges = graded(3, -1, 1, 8)
    vertices, facets = moved(torus(20, 10), np.random.default_rng(0))
    solid = compute(edges, n, (vertices, facets))
    outer = box([-2, -2, -2], [2, 2, 2])
    fluid = compute(edges, n, together(outer, (vertices, facets[:, ::-1].copy())))
    np.testing.assert_allclose(solid.fraction + fluid.fraction, 1, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(solid.cells, fluid.cells)
    full = np.broadcast_to(tensor(weights(n), weights(n), weights(n)), solid.solid.shape)
    np.testing.assert_allclose(solid.solid + fluid.solid, full, rtol=0, atol=1e-14)
    volume = corners_and_sizes(edges, all_cells(edges))[1].prod(axis=1)
    assert abs((solid.fraction + fluid.fraction) @ volume - 8) < 1e-12


@pytest.mark.parametrize("n", [3, 4, 5])
@pytest.mark.parametrize(("height", "volume", "area"), [(1.0, 1 / 6, np.sqrt(3) / 2), (1.5, 1 / 2, 3 * np.sqrt(3) / 4)])
def test_plane_through_the_unit_cube(n, height, volume, area):
    corner = height * np.eye(3)
    surface = simplex([[0, 0, 0], *corner])
    edges = [np.array([0.0, 1.0])] * 3
    found = compute(edges, n, surface)
    tilted = np.isclose(normals(surface)[0][found.piece_facet].sum(axis=1), np.sqrt(3))
    assert abs(found.piece_mass[tilted].sum() - area) < 1e-14
    assert abs(found.solid.sum() - volume) < 1e-15
    assert abs(found.fraction[0] - volume) < 1e-15
    if height == 1.0:
        x, one = gauss(n), np.ones(n)
        for factors, value in [((x, one, one), 1 / 24), ((one, x**2, one), 1 / 60), ((x, one, x), 1 / 120)]:
            assert abs(found.solid[0] @ tensor(*factors) - value) < 1e-15


def test_areas_converge_to_those_of_smooth_bodies():
    edges = uniform(3, -1, 1, 6)
    errors = []
    for refinements in (2, 3):
        found = compute(edges, 2, sphere(0.6, refinements))
        volume = found.fraction @ corners_and_sizes(edges, all_cells(edges))[1].prod(axis=1)
        errors.append([4 / 3 * np.pi * 0.6**3 - volume, 4 * np.pi * 0.6**2 - found.piece_mass.sum()])
    np.testing.assert_allclose(np.divide(*errors), 4, rtol=0.1)
    found = compute(edges, 2, torus(128, 64))
    volume = found.fraction @ corners_and_sizes(edges, all_cells(edges))[1].prod(axis=1)
    np.testing.assert_allclose([volume, found.piece_mass.sum()], [0.394784, 3.947842], rtol=3e-3)


def test_any_points_will_do():
    """The basis belongs to the points given, be they Gauss points or not: integrals of x^i y^j agree."""
    edges, surface = uniform(2, -1, 1, 3), moved(star(5, 0.3, 0.8), np.random.default_rng(0))
    uneven = np.array([0.05, 0.3, 0.9])
    given, other = moments(edges, gauss(3), *surface), moments(edges, uneven, *surface)
    for i, j in itertools.product(range(3), repeat=2):
        np.testing.assert_allclose(
            given.solid @ tensor(gauss(3) ** i, gauss(3) ** j), other.solid @ tensor(uneven**i, uneven**j), atol=1e-14
        )
        np.testing.assert_allclose(
            np.einsum("pqv,q->pv", given.piece_moments, tensor(gauss(3) ** i, gauss(3) ** j)),
            np.einsum("pqv,q->pv", other.piece_moments, tensor(uneven**i, uneven**j)),
            atol=1e-14,
        )


# Surfaces and grid planes

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


# Random cuts

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
@pytest.mark.parametrize("seed", [0, 1])
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


# Only some cells wanted


@pytest.mark.parametrize("dim", [2, 3])
def test_wanted_cells_are_those_of_all(dim):
    """Bit for bit, whatever the selection: processes agree on cells that several of them ask for."""
    edges = graded(dim, -1, 1, 9)
    surface = moved(star(9, 0.3, 1.2) if dim == 2 else torus(40, 20, 0.7, 0.35), np.random.default_rng(0))
    whole = compute(edges, 3, surface)
    cells = all_cells(edges)
    rng = np.random.default_rng(1)
    low, _ = corners_and_sizes(edges, cells)
    half = [(low[:, d] < 0.1) == side for d in range(dim) for side in (True, False)]
    chosen = [rng.random(len(cells)) < share for share in (0.02, 0.3, 0.9)]
    corner = (low < -0.3).all(axis=1)
    for wanted in [*half, *chosen, corner, np.zeros(len(cells), dtype=bool), np.ones(len(cells), dtype=bool)]:
        part = compute(edges, 3, surface, wanted)
        np.testing.assert_array_equal(part.fraction, np.where(wanted, whole.fraction, np.nan))
        kept = wanted[whole.cells]
        np.testing.assert_array_equal(part.cells, whole.cells[kept])
        np.testing.assert_array_equal(part.solid, whole.solid[kept])
        pieces = kept[whole.piece_cell]
        np.testing.assert_array_equal(part.cells[part.piece_cell], whole.cells[whole.piece_cell[pieces]])
        np.testing.assert_array_equal(part.piece_facet, whole.piece_facet[pieces])
        np.testing.assert_array_equal(part.piece_moments, whole.piece_moments[pieces])
        np.testing.assert_array_equal(part.piece_mass, whole.piece_mass[pieces])


def test_facets_without_area_are_left_out():
    vertices, facets = simplex([[0.1, 0.1, 0.1], [0.9, 0.2, 0.1], [0.2, 0.9, 0.1], [0.3, 0.3, 0.9]])
    edges = uniform(3, 0, 1, 2)
    found = compute(edges, 3, (vertices, facets))
    point_and_line = np.array([[0, 0, 0], [1, 2, 1]])
    more = compute(edges, 3, (vertices, np.concatenate([facets, point_and_line])))
    np.testing.assert_array_equal(found.solid, more.solid)
    np.testing.assert_array_equal(found.piece_facet, more.piece_facet)


# Errors

GOOD = {
    "edges": [np.linspace(0, 1, 3)] * 3,
    "points": gauss(3),
    "vertices": np.eye(4, 3),
    "facets": np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]]),
    "wanted": np.ones(8, dtype=bool),
}
LINE = np.linspace(0, 1, 3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"edges": [LINE]}, "edges must be 2 or 3 arrays, not 1"),
        ({"edges": [LINE, LINE, np.zeros((2, 2))]}, "edges[2] must have 1 axis, not 2"),
        ({"edges": [LINE, np.arange(3), LINE]}, "edges[1] must be of type float64"),
        ({"edges": [np.linspace(0, 1, 6)[::2], LINE, LINE]}, "edges[0] must be contiguous, row by row "
                                                             "(numpy.ascontiguousarray)"),
        ({"edges": [LINE, LINE, LINE[:1]]}, "edges[2] must have at least 2 entries"),
        ({"edges": [LINE, np.array([0, 0.5, 0.5]), LINE]}, "edges[1] must increase; entries 1 and 2 do not"),
        ({"edges": [LINE, LINE, np.array([0, np.inf])]}, "edges[2] must be finite; row 1 is not"),
        ({"points": gauss(6)}, "points must be 2 to 5 numbers, not 6"),
        ({"points": gauss(1)}, "points must be 2 to 5 numbers, not 1"),
        ({"points": np.array([0.0, 0.5])}, "points must increase within (0, 1)"),
        ({"points": np.array([0.5, 1.0])}, "points must increase within (0, 1)"),
        ({"points": np.array([0.5, 0.2])}, "points must increase within (0, 1)"),
        ({"points": np.array([0.5, np.nan])}, "points must increase within (0, 1)"),
        ({"vertices": np.eye(4)}, "vertices must have 3 columns in 3D, not 4"),
        ({"edges": [LINE, LINE]}, "vertices must have 2 columns in 2D, not 3"),
        ({"vertices": np.zeros(3)}, "vertices must have 2 axes, not 1"),
        ({"vertices": np.eye(4, 3).astype(np.float32)}, "vertices must be of type float64"),
        ({"vertices": np.asfortranarray(np.eye(4, 3))}, "vertices must be contiguous, row by row "
                                                        "(numpy.ascontiguousarray)"),
        ({"vertices": np.where(np.eye(4, 3) * [0, 0, 1] > 0, np.nan, 0)}, "vertices must be finite; row 2 is not"),
        ({"vertices": 1e200 * (np.eye(4, 3) - 0.2)}, "facet 0 is too large to have an area"),
        ({"facets": np.zeros((4, 2), dtype=np.int64)}, "facets must have 3 columns in 3D, not 2"),
        ({"facets": GOOD["facets"].astype(float)}, "facets must be of type int64"),
        ({"facets": GOOD["facets"].astype(np.int32)}, "facets must be of type int64"),
        ({"facets": GOOD["facets"][:, ::-1]}, "facets must be contiguous, row by row (numpy.ascontiguousarray)"),
        ({"facets": GOOD["facets"] + 1}, "facet 1 names vertex 4, there are 4"),
        ({"facets": GOOD["facets"] - 1}, "facet 0 names vertex -1, there are 4"),
        ({"wanted": np.ones(7, dtype=bool)}, "wanted must have one flag for each of 8 cells, not 7"),
        ({"wanted": np.ones(8)}, "wanted must be of type bool"),
    ],
)  # fmt: skip
def test_errors(change, message):
    moments(**GOOD)
    with pytest.raises(ValueError) as raised:
        moments(**(GOOD | change))
    assert str(raised.value) == message
