"""Parts of the fluid that touching bodies divide within a step share nodes, wherever its iterates were."""

import numpy as np
from fluid_setup import block, body

from solvers.fluid.flow.thin_bodies import ThinBodies
from solvers.fluid.geometry.thin.sheet_cycles import _divided
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.surface import Motion


def test_flaps_that_touch_and_open_within_a_step():
    """The film below the end of one is parted from the fluid above it by contact, and joined at the first change."""
    grid = uniform([0, 0], [2, 1], [20, 10])
    low, below = block([0.92, -0.2], [0.95, 0.54])
    high, above = block([0.96, 0.3], [0.99, 1.2])
    low[:, 0] -= 0.02 * (low[:, 1] < 0.0)  # inclined: it touches with its upper corner only
    facets = np.concatenate([below, above + len(low)])
    bodies = [
        body(name, *one, motion=lambda x, t: (x, 0.0 * x))
        for name, one in (("low", (low, below)), ("high", (high, above)))
    ]

    def at(way):
        x = np.concatenate([low + np.array([way, 0.0]), high])
        return Motion(x, 0.0 * x)

    apart, touching = at(0.0), at(0.0101)
    thin, other = (ThinBodies(grid, bodies, (), None) for _ in range(2))
    parted = other.sheets(facets, touching)
    opened = thin.sheets(facets, apart)
    thin.begin_step()
    joined = thin.sheets(facets, touching)
    assert not len(opened.touching)
    assert len(parted.touching)
    assert joined.node_count(1) < parted.node_count(1)
    thin.begin_step()
    assert thin.sheets(facets, touching).same_unknowns(parted)
    # the step starts where they touch, and iterates part them in vain
    assert thin.sheets(facets, apart).same_unknowns(opened)
    assert thin.sheets(facets, touching).same_unknowns(parted)
    assert not thin.release(facets, touching)
    assert thin.sheets(facets, apart).same_unknowns(opened)
    held = thin.sheets(facets, touching)  # a cycle: as in a step in which they touch for the first time
    assert held.same_unknowns(joined)
    assert thin.release(facets, touching)
    assert thin.sheets(facets, touching).same_unknowns(parted)
    for position in (apart, touching, apart):
        thin.sheets(facets, position)
    assert thin.sheets(facets, touching).same_unknowns(joined)  # it comes back: it belongs to the solution
    assert not thin.release(facets, touching)


def test_parts_with_a_common_facet_are_not_divided_if_they_were_two_before():
    assert _divided([{1, 2}, {2, 3}], [{1, 2}, {2, 3}]) == frozenset()
    assert _divided([{1, 2, 3}], [{1, 2}, {2, 3}]) == {1, 2, 3}
    assert _divided([{1, 2}, {2, 3}], [{1, 2, 3}]) == {1, 2, 3}
    assert _divided([{1}], [{1}, {4}]) == frozenset()
    assert _divided([], [{1}]) == frozenset()


def test_the_start_of_a_step_is_no_iterate():
    """What is at the start comes back once without being joined, as after a predictor that is taken back."""
    grid = uniform([0, 0], [2, 1], [20, 10])
    x, facets = block([0.92, -0.2], [0.95, 0.54])
    thin = ThinBodies(grid, [body("flap", x, facets, motion=lambda x, t: (x, 0.0 * x))], (), None)
    there, away = Motion(x, 0.0 * x), Motion(x - [0.0, 0.05], 0.0 * x)
    alone = thin.sheets(facets, there)
    for _ in range(2):
        thin.begin_step()
        for position in (there, away, there):
            thin.sheets(facets, position)
        assert not thin.release(facets, there)
        assert thin.sheets(facets, there).same_unknowns(alone)
