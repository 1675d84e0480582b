"""Shortest distances between points and facets with known answers."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.distance import distances

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ((0.3, 0.6, 0.25), 0.25),  # above the inside
        ((0.3, 0.6, -0.5), 0.5),  # below it
        ((1.3, 0.5, 0.4), 0.5),  # beside an edge
        ((-3.0, -4.0, 0.0), 5.0),  # beyond a corner
        ((0.5, 0.5, 0.0), 0.0),
    ],
)
def test_to_a_square(point, distance):
    found = distances(np.array([point]), SQUARE, np.array([[0, 1, 2, 3]]), "quad")
    assert found == pytest.approx([distance], abs=1e-14)


@pytest.mark.parametrize(
    ("point", "distance"), [((0.5, 0.2), 0.2), ((-3.0, 4.0), 5.0), ((2.0, 0.0), 1.0), ((0.25, 0.0), 0.0)]
)
def test_to_a_segment(point, distance):
    x = np.array([[0.0, 0.0], [1.0, 0.0]])
    assert distances(np.array([point]), x, np.array([[0, 1]]), "line") == pytest.approx([distance], abs=1e-14)


def test_the_nearest_of_all_facets_counts():
    points = np.array([[0.5, 0.5, 0.7], [5.0, 5.0, 0.1], [0.5, 0.5, 2.0]])
    x = np.concatenate([SQUARE, SQUARE + np.array([0.0, 0.0, 2.5])])
    facets = np.array([[0, 1, 2, 3], [4, 5, 6, 7]])
    assert distances(points, x, facets, "quad") == pytest.approx([0.7, np.hypot(np.hypot(4.0, 4.0), 0.1), 0.5])
