"""Rows of the flow by the motion of a surface: the kernel against the same sums by NumPy."""

import numpy as np
import pytest

from solvers import kernels


def random_arguments(dim, pieces=5, cells=3, points=7):
    some, functions = np.random.default_rng(dim).normal, 2**dim
    return (
        some(size=(pieces, points, dim)),
        some(size=(cells, points, functions, dim + 1)),
        np.arange(pieces) % cells,
        some(size=(pieces, dim)),
        some(size=(pieces, functions, dim, dim + 1)),
        some(size=(pieces, dim, dim, dim + 1)),
        some(size=pieces),
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_sums_over_points_and_vertices(dim):
    moments, density, cell, normal, fields, by_motion, leak = given = random_arguments(dim)
    rows = np.empty((len(normal), 2**dim, dim, dim, dim + 1))
    kernels.surface_rows(*given, rows)
    exact = np.einsum("pqc,pqai,pj->pacji", moments, density[cell], normal)
    exact -= np.einsum("pa,pcji->pacji", fields[..., 0].sum(axis=2), by_motion)
    exact[..., dim] -= leak[:, None, None, None] * fields[..., 1:]
    np.testing.assert_allclose(rows, exact, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(
    ("which", "replacement", "message"),
    [
        (0, np.zeros((5, 6, 3)), "moments has another shape"),
        (2, np.array([0, 1, 2, 0, 3]), "a piece is in no cell of the density"),
        (3, np.zeros((5, 4)), "no element has such rows"),
        (6, np.zeros(4), "leak has another shape"),
    ],
)
def test_wrong_shapes_are_refused(which, replacement, message):
    given = list(random_arguments(3))
    given[which] = replacement
    with pytest.raises(ValueError, match=message):
        kernels.surface_rows(*given, np.empty((5, 8, 3, 3, 4)))


def test_a_process_without_pieces():
    rows = np.empty((0, 8, 3, 3, 4))
    kernels.surface_rows(*random_arguments(3, pieces=0), rows)
