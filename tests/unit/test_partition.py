"""Blocks of cells for the processes."""

from __future__ import annotations

import numpy as np
import pytest
from fluid_setup import body, circle, loop

from solvers.fluid.grid.box import uniform
from solvers.fluid.mesh.partition import COST_OF_COUPLED, COST_OF_MOVING, CUT, blocks, destinations, work
from solvers.fluid.surfaces.immersed import ImmersedBody


def extent(owner, shape, rank):
    """(count of cells of a process, count of those in its bounding box)."""
    at = np.argwhere(owner.reshape(shape, order="F") == rank)
    return len(at), int(np.prod(at.max(axis=0) - at.min(axis=0) + 1))


@pytest.mark.parametrize(("shape", "parts"), [((8, 8), 4), ((12, 7), 3), ((9, 8, 10), 7), ((2, 2), 4), ((5, 1), 2)])
def test_every_process_has_one_block(shape, parts):
    owner = blocks(shape, np.ones(int(np.prod(shape))), parts)
    counts = [extent(owner, shape, rank) for rank in range(parts)]
    assert all(cells == box > 0 for cells, box in counts)
    assert sum(cells for cells, _ in counts) == np.prod(shape)


def test_equal_cells_are_divided_equally():
    owner = blocks((16, 16, 16), np.ones(4096), 16)
    assert np.all(np.bincount(owner) == 256)


def test_heavy_cells_count():
    """All work in the last quarter: half of it is an eighth of the cells."""
    amount = np.zeros((16, 4), order="F")
    amount[12:] = 1.0
    owner = blocks((16, 4), amount.ravel(order="F"), 2)
    assert np.bincount(owner).tolist() == [56, 8]


def test_work_of_cells():
    """A disc that rests, one with a motion, and one moved by another field: no work inside, most on the rim."""
    grid, rests = uniform([0, 0], [1, 1], [10, 10]), body("disc", circle((0.5, 0.5), 0.3, 64), loop(64))
    given = ImmersedBody(rests.surface, rests.motion)
    moved = ImmersedBody(rests.surface, None, start=rests.motion(0.0).x)
    rim = {}
    for some, of_piece in ((rests, 0.0), (given, COST_OF_MOVING), (moved, COST_OF_COUPLED)):
        amount = work(grid, [some]).reshape(10, 10, order="F")
        assert np.all(amount[4:6, 4:6] == 0.0)
        assert np.all(amount[0] == 1.0)
        pieces = (amount[2, 4] - CUT, amount[7, 5] - CUT)
        assert pieces[0] == pytest.approx(pieces[1])
        rim[of_piece] = pieces[0]
    assert rim[0.0] == 0.0
    assert rim[COST_OF_COUPLED] / COST_OF_COUPLED == pytest.approx(rim[COST_OF_MOVING] / COST_OF_MOVING)
    assert 3 <= round(rim[COST_OF_COUPLED] / COST_OF_COUPLED, 9) <= 5  # a segment has 0.029, a cell 0.1
    assert np.all(work(grid, [ImmersedBody(rests.surface, None)]) == 1.0)


@pytest.mark.parametrize("shape", [(6, 5), (4, 3, 5)])
def test_destinations_are_owners_and_neighbours(shape):
    owner = blocks(shape, np.ones(int(np.prod(shape))), 5)
    processes, offsets = destinations(shape, owner)
    box = owner.reshape(shape, order="F")
    for cell, at in enumerate(np.ndindex(*reversed(shape))):
        index = tuple(reversed(at))
        expected = set()
        for axis in range(len(shape)):
            for side in (-1, 1):
                beside = (*index[:axis], index[axis] + side, *index[axis + 1 :])
                if 0 <= beside[axis] < shape[axis]:
                    expected.add(int(box[beside]))
        found = processes[offsets[cell] : offsets[cell + 1]].tolist()
        assert found[0] == owner[cell]
        assert sorted(found[1:]) == sorted(expected - {owner[cell]})
