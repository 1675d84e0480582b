"""Tables of surfaces that move in part: cells that are kept make the same table as all cells computed."""

from dataclasses import fields

import numpy as np
import pytest
from cut_scenes import EVEN, FAMILIES, POINTS, block, joined, sphere
from fluid_setup import circle, loop

from solvers.cut_cells import CellCutter, ClosedSurfaces, cut_cells


def assert_as_fresh(cutter, edges, surfaces, x, **choices):
    one, other = cutter.cut(x), cut_cells(edges, POINTS, surfaces, x, **choices)
    for field in fields(one):
        assert np.array_equal(getattr(one, field.name), getattr(other, field.name)), field.name
    return one


def moves(rng, x, facets, body):
    """Vertices one after the other: unmoved, one body, some vertices, all, a body far away, back, in a plane."""
    of_body = np.isin(np.arange(len(x)), facets[body == rng.integers(body.max() + 1)])
    some = rng.random(len(x)) < 0.3
    steps = (0 * x, of_body[:, None] * [1e-3, 0, -2e-3], some[:, None] * rng.uniform(-1e-4, 1e-4, x.shape), 0 * x,
             np.full_like(x, 0.01), of_body[:, None] * [0.7, 0.3, 0.2])  # fmt: skip
    now = x
    for step in steps:
        now = now + step
        yield now
    yield np.where(of_body[:, None], now + 1e6, now)
    yield now
    yield x
    yield np.round(4 * x) / 4 if len(x) <= 24 else x


@pytest.mark.parametrize("closing", [0.0, 1e-6, 0.05])
@pytest.mark.parametrize("name", FAMILIES)
def test_cells_that_are_kept(name, closing):
    for seed in range(3):
        edges, x, facets, body = FAMILIES[name].pose(seed)
        surfaces = ClosedSurfaces(facets, body)
        choices = {"closing": closing, "only_exact": seed == 1}
        cutter = CellCutter(edges, POINTS, surfaces, **choices)
        for now in moves(np.random.default_rng(seed), x, facets, body):
            if name != "small ball" or seed == 0:
                assert_as_fresh(cutter, edges, surfaces, now, **choices)


def test_a_body_that_comes_around_others():
    """A block grows around cells that others cut, and shrinks again: their cells are not moved, but solid."""
    inner, ball = block([1.2] * 3, [1.9] * 3), sphere((1.6, 1.6, 2.4), 0.5, 1)
    outer, facets = block([3.1] * 3, [3.9] * 3)
    x, all_facets, body = joined(inner, ball, (outer, facets))
    surfaces = ClosedSurfaces(all_facets, body)
    cutter = CellCutter(EVEN, POINTS, surfaces, closing=1e-3)
    shares = []
    for corner in (3.1, 0.5, 3.1, 1.55, 3.1):
        x[-8:] = np.where(outer == 3.1, corner, 3.9)
        shares.append(assert_as_fresh(cutter, EVEN, surfaces, x, closing=1e-3).share.sum())
    assert shares[0] == shares[2] == shares[4]
    assert len(set(shares)) == 3


def test_layers_that_coincide():
    """Two layers of one body that coincide in cells: another layer decides whether there is solid around them."""
    x, facets, body = joined(block([1.3] * 3, [1.7] * 3), (block([1.3] * 3, [1.7] * 3)[0], block([1.3] * 3, [1.7] * 3)[1][:, ::-1]), block([3.1] * 3, [3.9] * 3))  # fmt: skip  # noqa: E501
    surfaces = ClosedSurfaces(facets, 0 * body)
    cutter = CellCutter(EVEN, POINTS, surfaces)
    for corner in (3.1, 0.5, 3.1):
        x[-8:] = np.where(x[-8:] < 3.5, corner, 3.9)
        assert_as_fresh(cutter, EVEN, surfaces, x)


def test_plane():
    edges = EVEN[:2]
    x = np.concatenate([circle((2, 2), 1.1, 30), circle((3.4, 3.1), 0.6, 20)])
    surfaces = ClosedSurfaces(np.concatenate([loop(30), loop(20) + 30]), np.repeat([0, 1], [30, 20]))
    cutter = CellCutter(edges, POINTS, surfaces, closing=0.05)
    for step in (0.0, 0.0, 0.01, -0.1, 0.5):
        x[30:] += step
        assert_as_fresh(cutter, edges, surfaces, x, closing=0.05)


def test_cells_are_kept():
    """A table of vertices that did not move repeats no cell: the time is below half of a fresh one's."""
    from time import process_time

    x, facets = sphere((2.52, 2.47, 2.55), 1.7, 4)
    edges = (np.linspace(0, 5, 17),) * 3
    surfaces = ClosedSurfaces(facets, 0 * facets[:, 0])
    cutter, times = CellCutter(edges, POINTS, surfaces), []
    for keep in (False, True, True, True, True):
        start = process_time()
        cutter.cut(x, keep=keep)
        times.append(process_time() - start)
    assert min(times[2:]) < 0.5 * times[0]
