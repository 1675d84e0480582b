"""Angles under which surfaces are seen from points."""

import numpy as np
import pytest
from fluid_setup import block

from solvers import kernels
from solvers.fluid.surfaces.inside import IN_PLANE


def seen(points, x, facets, in_plane=IN_PLANE):
    arrays = (np.ascontiguousarray(points, dtype=float), np.ascontiguousarray(x, dtype=float))
    return kernels.seen_angles(*arrays, np.ascontiguousarray(facets, dtype=np.int64), in_plane)


@pytest.mark.parametrize("scale", [1.0, 1e-3])
@pytest.mark.parametrize("dim", [2, 3])
def test_block(dim, scale):
    """In a block the whole angle, outside none, on a face half of it, at a corner the part that its faces see."""
    x, facets = block([0.0] * dim, [2.0] * dim)
    corner = 2.0 * np.pi / 2**dim
    places = {(1.1,) * dim: 2 * np.pi, (2.3,) * dim: 0.0, (0.0, 0.9, 0.7)[:dim]: np.pi, (2.0,) * dim: corner}
    found = seen(scale * np.array(list(places)), scale * x, facets)
    np.testing.assert_allclose(found, list(places.values()), atol=1e-12)


def test_an_octant():
    """A triangle on three axes is seen from the origin as an eighth of the sphere; its half is given."""
    triangle = np.array([[0, 1, 2]])
    assert seen([[0, 0, 0]], np.eye(3), triangle)[0] == pytest.approx(np.pi / 4, rel=1e-15)
    assert seen([[0, 0, 0]], np.eye(3), triangle[:, ::-1])[0] == pytest.approx(-np.pi / 4, rel=1e-15)


def test_nearly_in_a_plane():
    """What lies in the plane of a facet up to the given sine is not seen."""
    segment = np.array([[0.0, 0.0], [1.0, 0.0]])
    point = [[-1.0, 1e-6]]
    assert abs(seen(point, segment, [[0, 1]], 1e-9)[0]) == pytest.approx(5e-7, rel=1e-6)
    assert seen(point, segment, [[0, 1]], 1e-5)[0] == 0.0


def test_nothing():
    assert seen(np.zeros((0, 3)), np.eye(3), [[0, 1, 2]]).shape == (0,)
    assert seen([[0, 0, 0]], np.zeros((0, 3)), np.zeros((0, 3))).tolist() == [0.0]


@pytest.mark.parametrize(
    ("points", "x", "facets", "message"),
    [
        (np.zeros((1, 3)), np.eye(3), [[0, 1, 3]], "facets name vertices that are not there"),
        (np.zeros((1, 3)), np.eye(3), [[0, 1, -1]], "facets name vertices that are not there"),
        (np.zeros((1, 2)), np.eye(3), [[0, 1, 2]], "points has another shape"),
        (np.zeros((1, 3)), np.eye(3), [[0, 1]], "facets has another shape"),
        (np.zeros((1, 4)), np.eye(4), [[0, 1, 2, 3]], "vertices have two or three coordinates"),
    ],
)
def test_mistakes(points, x, facets, message):
    with pytest.raises(ValueError) as error:
        seen(points, x, facets)
    assert str(error.value) == message
