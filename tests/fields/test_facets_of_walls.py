"""Which bodies are walls: with fluid on both sides that is not connected around them."""

import numpy as np
import pytest
from fluid_setup import circle, loop, sphere

from solvers.fluid.geometry.thin.walls import facets_of_walls
from solvers.fluid.grid.box import uniform

BOX = uniform([-1, -1], [1, 1], [10, 10])


def surfaces(*circles):
    """(facets, vertices) of circles (centre, radius); those with a negative radius are turned inwards."""
    points = [circle(centre, abs(radius), 24) for centre, radius in circles]
    facets = [24 * k + loop(24)[:, :: 1 if radius > 0 else -1] for k, (_, radius) in enumerate(circles)]
    return np.concatenate(facets), np.concatenate(points)


@pytest.mark.parametrize("shift", [0.0, 0.067])
@pytest.mark.parametrize(
    ("circles", "walls"),
    [
        ([(0.0, 0.7)], [False]),
        ([(0.0, 0.7), (0.0, -0.5)], [True, True]),
        ([(0.0, 0.7), (0.0, -0.1)], [True, True]),  # no cell is full of the fluid in it
        ([(0.0, 0.7), (0.0, -0.02)], [True, True]),
        ([(0.0, 0.7), (0.0, -0.3), (0.0, 0.299)], [False] * 3),  # a pin with play
        ([(0.0, 0.7), (0.0, -0.3), (0.0, 0.3)], [False] * 3),  # without
        ([(-0.3, 0.4), (-0.3, -0.05), (0.6, 0.2)], [True, True, False]),
    ],
)
def test_rings(circles, walls, shift):
    places = [(np.array([x + shift, 0.4 * shift]), radius) for x, radius in circles]
    found = facets_of_walls(BOX, *surfaces(*places)).reshape(-1, 24)
    assert found.all(axis=1).tolist() == found.any(axis=1).tolist() == walls


@pytest.mark.parametrize(("inner", "wall"), [(0.1, True), (None, False)])
def test_balls(inner, wall):
    shapes = [sphere((0.03, 0.02, 0.01), 0.7, 2)]
    if inner:
        x, facets = sphere((0.03, 0.02, 0.01), inner, 1)
        shapes.append((x, len(shapes[0][0]) + facets[:, ::-1]))
    box = uniform([-1] * 3, [1] * 3, [10] * 3)
    x, facets = (np.concatenate(some) for some in zip(*shapes, strict=True))
    assert facets_of_walls(box, facets, x).all() == facets_of_walls(box, facets, x).any() == wall


def test_nothing_and_open_surfaces():
    facets, x = surfaces((np.zeros(2), 0.7), (np.zeros(2), -0.5))
    assert not facets_of_walls(BOX, facets[1:], x).any()
    assert len(facets_of_walls(BOX, facets[:0], x)) == 0
