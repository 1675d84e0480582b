"""Numbers of cells and nodes around thin bodies: functions of what is connected, kept where that stays as it is."""

from dataclasses import fields

import numpy as np
import pytest
from fluid_setup import block, body, turned
from thin_space import turn

from solvers.fluid.flow.thin_bodies import ThinBodies
from solvers.fluid.geometry.pieces import off_boundary
from solvers.fluid.geometry.thin.sheet_windows import SheetWindows
from solvers.fluid.geometry.thin.sheets import find_sheets
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.surface import Motion

CELLS = {2: (20, 10), 3: (8, 6, 6)}


def plate(dim):
    """In the middle of a layer of cells, with ends in the fluid: (points [cells], facets)."""
    return block([2.3, 4.4, 1.2][:dim], [6.7, 4.6, 4.7][:dim])


def grid_of(dim):
    return uniform([0.0] * dim, list(CELLS[dim]), list(CELLS[dim]))


@pytest.mark.parametrize("dim", [2, 3])
def test_sides_that_are_alike_keep_their_numbers(dim):
    """Iterates that move fluid from one side of a cell to the other and back have the same unknowns: nothing recurs."""
    points, facets = block([-1.0, 4.4, -1.0][:dim], [21.0, 4.6, 7.0][:dim])
    up = np.eye(dim)[1]
    thin = ThinBodies(grid_of(dim), [body("plate", points, facets, motion=lambda x, t: (x, 0.0 * x))], (), None)
    found = [thin.sheets(facets, Motion(points + way * up, 0.0 * points)) for way in (-0.1, 0.1, -0.1, 0.1)]
    assert found[0].node_count(1) > found[0].lattice_size(1)
    assert all(one.same_unknowns(found[0]) for one in found)
    assert not len(thin.save()["joined"])
    off = off_boundary(grid_of(dim), points[facets])
    fresh = [find_sheets(grid_of(dim), facets, points + way * up, off, always=True) for way in (-0.1, 0.1)]
    assert fresh[0].same_unknowns(fresh[1])


def positions(dim, draw, count):
    """Two plates that turn, part and lie on each other, by small and by large ways, and a third one that rests."""
    rng = np.random.default_rng(draw)
    points, _ = plate(dim)
    found, gap, way, angle = [], 0.0, np.zeros(dim), 0.0
    for _ in range(count):
        small = rng.choice([1e-6, 1e-3, 0.3])
        gap = rng.choice([0.0, gap, rng.uniform(0.0, 0.5)])
        way, angle = way + small * rng.uniform(-1.0, 1.0, dim), angle + 0.3 * small * rng.uniform(-1.0, 1.0)
        both = np.concatenate([points - 0.1 * np.eye(dim)[1], points + (0.1 + gap) * np.eye(dim)[1]])
        middle = both.mean(axis=0)
        rotated = turned(both - middle, angle) if dim == 2 else (both - middle) @ turn(angle, 0.5 * angle).T
        found.append(np.concatenate([rotated + middle + way, points + 1.13 * np.eye(dim)[1]]))
    return found


@pytest.mark.parametrize("draws", [range(4), pytest.param(range(4, 60), marks=pytest.mark.slow)], ids=str)
@pytest.mark.parametrize("dim", [2, 3])
def test_numbers_that_are_kept_are_those_of_a_fresh_search(dim, draws):
    """Bit for bit, as the table of cut cells, whatever was before; numbers are kept in some places, not in others."""
    points, facets = plate(dim)
    grid, every, kept = grid_of(dim), np.concatenate([facets + k * len(points) for k in range(3)]), []
    for draw in draws:
        before = None
        for x in positions(dim, draw, 8):
            fresh, follows = (
                find_sheets(grid, every, x, off_boundary(grid, x[every]), always=True, closing=True, before=one)
                for one in (None, before)
            )
            kept.append(before is not None and follows.numbering is before.numbering)
            assert follows.same_unknowns(fresh), draw
            for name in (one.name for one in fields(fresh.numbering) if one.name != "of"):
                assert np.array_equal(getattr(follows.numbering, name), getattr(fresh.numbering, name)), (draw, name)
            assert np.array_equal(follows.fluid, fresh.fluid), draw
            assert np.array_equal(follows.bounds, fresh.bounds), draw
            tables = (vars(one.parts.geometry.table(3)).values() for one in (follows, fresh))
            assert all(np.array_equal(*pair) for pair in zip(*tables, strict=True)), draw
            before = follows
    assert 0 < np.sum(kept) < len(kept)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("dim", [2, 3])
def test_windows_follow_the_fluid(dim, degree):
    """A node before an end reaches the copies of both sides, and takes the one that has more fluid now."""
    points, facets = plate(dim)
    grid, up = grid_of(dim), np.eye(dim)[1]
    off = off_boundary(grid, points[facets])
    low, high = (find_sheets(grid, facets, points + way * up, off, always=True) for way in (-0.1, 0.1))
    assert low.same_unknowns(high)
    numbers = np.arange(low.node_count(degree))
    index = np.stack(np.unravel_index(low.on_lattice(numbers, degree), low.lattice_shape(degree), order="F"), axis=1)
    follows, before, fresh = (SheetWindows(sheets, degree, numbers) for sheets in (low, low, high))
    for layers in (0, 2):
        follows.cells_around(numbers, index, layers)
    follows.follow(high)
    for layers in (0, 2):
        found, was, expected = (one.cells_around(numbers, index, layers) for one in (follows, before, fresh))
        assert all(np.array_equal(*pair) for pair in zip(found, expected, strict=True))
    assert not np.array_equal(was[0], expected[0])
