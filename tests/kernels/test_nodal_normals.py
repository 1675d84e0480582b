"""Averaged unit normals at the nodes of a surface, and the tangents that complete them to a frame."""

import numpy as np
import pytest
from mortar_surfaces import DIM, TYPES_2D, TYPES_3D, dense, jittered, patch, rotation

from solvers.kernels import nodal_normals


@pytest.mark.parametrize("facet_type", [*TYPES_2D, *TYPES_3D])
def test_normals_of_a_plane_and_a_sphere(facet_type):
    dim = DIM[facet_type]
    rotate = rotation(np.random.default_rng(9), dim)
    x, facets = patch(facet_type, 2)
    normals, _ = nodal_normals(x @ rotate.T, facets, facet_type)
    np.testing.assert_allclose(normals, np.tile(rotate[:, -1], (len(x), 1)), atol=1e-14)

    errors = []
    for n in (4, 8):
        x, facets = patch(facet_type, n)
        x[:, -1] = 1.0
        inner = np.all(np.abs(x[:, :-1]) < 0.4, axis=1)
        x /= np.linalg.norm(x, axis=1)[:, None]
        errors.append(np.abs(nodal_normals(x, facets, facet_type)[0] - x)[inner].max())
    assert errors[1] < 0.4 * errors[0] < 0.01


def test_masked_normals_lie_in_the_symmetry_plane():
    x, facets = patch("quad4", 2)
    x[:, 2] = 0.3 * x[:, 0] + 0.2 * x[:, 1] ** 2
    mask = np.ones_like(x)
    on_plane = x[:, 0] < -0.4
    mask[on_plane, 0] = 0.0
    normals, _ = nodal_normals(x, facets, "quad4", mask)
    plain, _ = nodal_normals(x, facets, "quad4")
    assert not normals[on_plane, 0].any()
    np.testing.assert_array_equal(normals[~on_plane], plain[~on_plane])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)


def test_derivatives_of_chosen_normals():
    """Those of the other nodes are left out, and all normals are the same."""
    rng = np.random.default_rng(4)
    x, facets = jittered(rng, "quad4", 3, 0.1)
    chosen = rng.integers(0, 2, len(x)).astype(np.uint8)
    everywhere, there = (nodal_normals(x, facets, "quad4", chosen=which) for which in (None, chosen))
    assert np.array_equal(there[0], everywhere[0])
    whole = dense(everywhere[1], x.size, x.size)
    whole[np.repeat(chosen == 0, 3)] = 0.0
    assert np.array_equal(dense(there[1], x.size, x.size), whole)
    with pytest.raises(ValueError, match="chosen must have"):
        nodal_normals(x, facets, "quad4", chosen=chosen[1:])
