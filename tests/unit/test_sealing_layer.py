"""A tight layer on contact surfaces: how far and in which direction vertices move."""

import numpy as np
import pytest

from coupling.sealing_layer import LARGEST_MOVE, SealingLayer
from solvers.mesh.tessellation import unit_normals

H = 0.01


def heights(facets, x):
    """Distance of the corners of facets on the layer from their planes on the solid."""
    covered = SealingLayer(facets, H).cover(x)
    return np.einsum("fcd,fd->fc", covered[facets] - x[facets], unit_normals(x[facets])), covered


def test_plane_moves_by_the_thickness():
    """Also with facets of different sizes around a vertex; vertices of other facets stay."""
    x = np.array([[0.0, 0, 0], [1, 0, 0], [1, 3, 0], [0, 1, 0], [5, 5, 5]])
    found, covered = heights(np.array([[0, 1, 2], [0, 2, 3]]), x)
    assert found == pytest.approx(H, rel=1e-14)
    assert np.array_equal(covered[4], x[4])


@pytest.mark.parametrize("angle", [np.pi / 2, 2 * np.pi / 3, np.pi - 0.01, 4 * np.pi / 3])
def test_both_sides_of_an_edge_move_by_the_thickness(angle):
    """angle: between the sides, in the solid, in a rotated frame; beyond pi the edge is a groove."""
    way = np.array([np.cos(angle), np.sin(angle)])
    x = np.array([[1.0, 0], [0, 0], way])
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    found, _ = heights(np.array([[1, 0], [2, 1]]), x @ turn.T)
    assert found == pytest.approx(H, rel=1e-12)


def test_sharp_edges_move_by_a_bounded_length():
    x = np.array([[1.0, 1e-3], [0, 0], [1, -1e-3]])
    facets = np.array([[0, 1], [1, 2]])
    _, covered = heights(facets, x)
    assert np.linalg.norm(covered - x, axis=1).max() == pytest.approx(LARGEST_MOVE * H)
    x[[0, 2]] = [1.0, 0.0]  # both sides of a plate without thickness: no direction
    assert np.array_equal(SealingLayer(facets, H).cover(x)[1], x[1])
