"""Shortest distances between points and facets with known answers."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.mesh.distance import nearest_points, signed_distances

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ((0.3, 0.6, 0.25), 0.25),  # above the inside
        ((0.3, 0.6, -0.5), -0.5),  # below it
        ((1.3, 0.5, 0.4), 0.5),  # beside an edge
        ((4.0, 0.5, -0.4), np.hypot(3.0, 0.4)),  # far beside it, below its plane
        ((-3.0, -4.0, 0.0), 5.0),  # beyond a corner
        ((0.5, 0.5, 0.0), 0.0),
    ],
)
def test_to_a_square(point, distance):
    down, points, facets = np.array([[0.0, 0.0, -1.0]]), np.array([point]), np.array([[0, 1, 2, 3]])
    found = signed_distances(points, down, SQUARE, facets, "quad")
    assert found == pytest.approx([distance], abs=1e-14)
    assert signed_distances(points, -down, SQUARE, facets, "quad") == pytest.approx([abs(distance)], abs=1e-14)
    foot = nearest_points(points, SQUARE[np.array([[0, 1, 2], [0, 2, 3]])])
    assert np.linalg.norm(foot - points) == pytest.approx(abs(distance), abs=1e-14)
    assert foot[0] == pytest.approx(np.clip(point, [0, 0, 0], [1, 1, 0]))


@pytest.mark.parametrize(
    ("point", "distance"),
    [((0.5, 0.2), -0.2), ((0.5, -0.2), 0.2), ((-4.0, 3.0), 5.0), ((2.0, 0.0), 1.0), ((0.25, 0.0), 0.0)],
)
def test_to_a_segment(point, distance):
    """The segment has the body on its left, above it; the other surface looks up."""
    x, up = np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[0.0, 1.0]])
    found = signed_distances(np.array([point]), up, x, np.array([[0, 1]]), "line")
    assert found == pytest.approx([distance], abs=1e-14)
    foot = nearest_points(np.array([point]), x[None])
    assert foot[0] == pytest.approx(np.clip(point, [0, 0], [1, 0]))


def test_the_nearest_of_all_facets_counts():
    points = np.array([[0.5, 0.5, 0.7], [5.0, 5.0, 0.1], [0.5, 0.5, 2.0]])
    x = np.concatenate([SQUARE, SQUARE + np.array([0.0, 0.0, 2.5])])
    facets = np.array([[0, 1, 2, 3], [4, 5, 6, 7]])
    down = np.tile([0.0, 0.0, -1.0], (3, 1))
    found = signed_distances(points, down, x, facets, "quad")
    assert found == pytest.approx([0.7, np.hypot(np.hypot(4.0, 4.0), 0.1), -0.5])


def test_a_corner_of_two_facets_has_one_sign():
    """A point below a ridge of 90 degrees, as far from both of its sides."""
    x = np.array([[-1.0, -1.0], [0.0, 0.0], [1.0, -1.0]])
    found = signed_distances(np.array([[0.0, -0.5]]), np.array([[0.0, -1.0]]), x, np.array([[1, 0], [2, 1]]), "line")
    assert found == pytest.approx([-np.sqrt(0.125)])
