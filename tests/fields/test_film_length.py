"""The length of films in cells, and whether they end at edges, before anything flows."""

from __future__ import annotations

import numpy as np
import pytest
from test_fluid_resolution import block, corners_of

from fsci import shapes
from solvers.fluid.flow.resolution.gaps import WallPlane
from solvers.fluid.flow.resolution.shape import at_start
from solvers.fluid.grid.box import uniform
from solvers.mesh.tessellation import tessellate


@pytest.mark.parametrize("scale", [1.0, 1e-3])
@pytest.mark.parametrize("half", [False, True])
def test_length_of_a_film(half, scale):
    """Between a cylinder and a wall what acts is (1 + x^2 / l^2)^-2, l^2 = 2 a g, over (pi / 2)^2 / (5 pi / 16) l."""
    gap, h = 0.01, 0.02
    grid = uniform([0.0 if half else -2.0 * scale, 0.0], [2.0 * scale, 3.0 * scale], [100 if half else 200, 150])
    disc = scale * corners_of(shapes.disc(1.0, [2000, 1]), (0.0, 1.0 + gap))
    walls = [(WallPlane(1, 0), "y-"), *([(WallPlane(0, 0, mirror=True), "x-")] if half else [])]
    (found,) = at_start(grid, walls, [("disc", disc)])
    (film,) = found.gaps
    assert film.along == pytest.approx(0.8 * np.pi * np.sqrt(2.0 * gap) / h, rel=0.05)  # up to gaps of five cells


@pytest.mark.parametrize("gap", [0.02, 0.5, 1.5])
def test_length_of_a_film_of_few_cells(gap):
    """The film of a cylinder of two cells radius, at any height: 0.8 pi sqrt(2 a g), to a third for wide ones."""
    grid = uniform([-8, 0], [8, 12], [32, 24])
    disc = corners_of(shapes.disc(1.0, [400, 1]), (0.1, 1.0 + gap))
    (found,) = at_start(grid, [(WallPlane(1, 0), "y-")], [("disc", disc)])
    (film,) = found.gaps
    assert not film.ends
    assert film.along == pytest.approx(0.8 * np.pi * np.sqrt(2.0 * gap) / 0.5, rel=0.1 if gap < 0.1 else 0.35)


def test_length_of_uniform_films():
    """Nothing changes along one between parallel planes; around a bearing the direction does, over two radii."""
    grid = uniform([0, 0], [4, 2], [40, 20])
    (found,) = at_start(grid, [(WallPlane(1, 0), "y-")], [("plate", block((6, 3), (-1, 0.05)))])
    assert (found.gaps[0].ends, found.gaps[0].along > 1e5) == (False, True)
    grid = uniform([-1.3, -1.3], [1.3, 1.3], [104, 104])
    bodies = [
        ("bush", corners_of(shapes.ring(1.01, 2.0, [400, 1]))),
        ("journal", corners_of(shapes.disc(1.0, [400, 1]))),
    ]
    _, journal = at_start(grid, [], bodies)
    assert journal.gaps[0].along == pytest.approx(0.8 * np.pi * 2.0 * 40, rel=0.05)


@pytest.mark.parametrize("turned", [False, True])
def test_films_that_end(turned):
    """Below a block, not below a disc that touches no edge, nor where a block goes on through the faces of the box."""
    grid = uniform([0, 0], [4, 3], [40, 30])
    scenes = {
        "block": (block((1, 1), (1.53, 0.03)), True),
        "disc": (corners_of(shapes.disc(0.5, [60, 1]), (2.0, 0.53)), False),
        "plate": (block((6, 1), (-1, 0.03)), False),
    }
    for name, (corners, ends) in scenes.items():
        placed = corners[..., ::-1][:, ::-1] if turned else corners
        (found,) = at_start(grid, [(WallPlane(0 if turned else 1, 0), "wall")], [(name, placed)])
        assert [gap.ends for gap in found.gaps] == [ends]


def test_a_disc_on_a_block_has_no_end_far_from_edges():
    grid = uniform([0, 0], [4, 3], [40, 30])
    for x, ends in ((2.0, False), (1.02, True)):
        bodies = [("low", block((2, 0.5), (1, 0.5))), ("disc", corners_of(shapes.disc(0.5, [60, 1]), (x, 1.53)))]
        for found in at_start(grid, [], bodies):
            assert [gap.ends for gap in found.gaps if gap.to != found.body] == [ends]


def test_length_of_films_in_space():
    """All of a flat film: the root of its area in cells, also of flat ones; a quarter between planes of symmetry."""
    facets, nodes = tessellate(mesh := shapes.box([0.8, 0.2, 0.5], [1, 1, 1]))
    corners = (mesh.points[nodes] + [0.0, 0.0, 0.01])[facets]
    walls = [(WallPlane(2, 0), "z-"), (WallPlane(0, 0, mirror=True), "x-"), (WallPlane(1, 0, mirror=True), "y-")]
    for high in (20, 60):
        (found,) = at_start(uniform([0, 0, 0], [1, 1, 1], [20, 40, high]), walls, [("block", corners)])
        (film,) = (gap for gap in found.gaps if gap.to == "z-")
        assert film.along == pytest.approx(2.0 * np.sqrt(16 * 8), rel=0.01)
