"""Parts of the fluid that iterates of a step divide and join, for ever, share nodes; those divided once do not."""

import numpy as np
from fluid_setup import block, body

from solvers.fluid.flow.thin_bodies import ThinBodies
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.surface import Motion


def test_flaps_that_touch_and_open_within_a_step():
    """The film below the end of one is parted from the fluid above it by contact, and joined where that recurs."""
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
    thin = ThinBodies(grid, bodies, (), None)
    opened = thin.sheets(facets, apart)
    thin.begin_step()
    parted = thin.sheets(facets, touching)
    assert not len(opened.touching)
    assert len(parted.touching)
    assert thin.sheets(facets, apart).same_unknowns(opened)
    joined = thin.sheets(facets, touching)  # a cycle: as in a step in which they touch for the first time
    assert joined.node_count(1) < parted.node_count(1)
    assert thin.release(facets, touching)
    assert thin.sheets(facets, touching).same_unknowns(parted)
    for position in (apart, touching, apart):
        thin.sheets(facets, position)
    assert thin.sheets(facets, touching).same_unknowns(joined)  # it comes back: it belongs to the solution
    assert not thin.release(facets, touching)
    thin.begin_step()
    assert thin.sheets(facets, touching).same_unknowns(parted)


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
