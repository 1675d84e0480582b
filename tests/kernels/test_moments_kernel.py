"""Moments of a solid in the cells of a box grid: exact to rounding for known bodies; ill-formed ones are refused."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from moments_setup import (
    all_cells,
    assert_integrals,
    box,
    compute,
    corners_and_sizes,
    gauss,
    graded,
    identity_errors,
    moved,
    normals,
    simplex,
    sphere,
    star,
    tensor,
    together,
    torus,
    uniform,
    weights,
)

from solvers.kernels import moments

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


@pytest.mark.parametrize("n", [2, 3, 4, 5, 7])
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
        ({"points": gauss(6)}, "points must be 2 to 5 numbers, or 7 in 2D, not 6"),
        ({"points": gauss(1)}, "points must be 2 to 5 numbers, or 7 in 2D, not 1"),
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
