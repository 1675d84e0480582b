"""Grids, bodies and checks for the tests of the moments kernel."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cache

import numpy as np

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
