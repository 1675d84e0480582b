"""Slits between surfaces in dry contact: one that closes twice in a step stays closed, else cells come and go."""

from dataclasses import replace

import numpy as np
import pytest
from fluid_setup import block, body, make_fluid

from solvers.fluid.cut.cut import SLIT
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.surface import Motion
from solvers.fluid.terms.boundary.patches import Patch

H = 0.1
CELL = 4 * 10 + 4  #: in the middle of both blocks


def between_blocks(seat, scheme="backward_euler"):
    """(a flow around two blocks in contact at y = seat, a function that opens a gap of so many cells between them)."""
    points, facets = block([0.2, seat], [0.8, 0.9])
    lower = body("lower", *block([0.2, 0.1], [0.8, seat]))
    upper = replace(body("upper", points, facets), motion=None, rests=False, start=points)
    bodies = [
        replace(one, surface=replace(one.surface, in_contact=np.ones(len(facets), dtype=bool)))
        for one in (lower, upper)
    ]
    out = Patch("out", ("x-", "x+", "y-", "y+"), "outflow")
    fluid = make_fluid(uniform([0, 0], [1, 1], [10, 10]), [out], bodies, scheme=scheme)

    def share(gap):
        """Share of fluid in the cell, if it is active as one with fluid."""
        fluid.move({"upper": Motion(points + np.array([0.0, gap * H]), np.zeros_like(points))})
        local = np.flatnonzero(fluid.grid.numbers == CELL)
        return float(fluid.cut.fraction[local][0])

    return fluid, share


@pytest.mark.parametrize("seat", [0.43, 0.43 + H / 3.0])
def test_a_slit_that_closes_twice_in_a_step_stays_closed(seat):
    """In that step alone, and however far it opens."""
    fluid, share = between_blocks(seat)
    assert share(0.05) == pytest.approx(0.05)
    fluid.begin_step(0.0, 0.1)
    assert share(0.02) == pytest.approx(0.02)
    assert share(-0.01) == 0.0
    assert share(0.03) == pytest.approx(0.03)
    assert share(-0.01) == 0.0
    assert share(0.5 * SLIT) == 0.0
    assert share(0.05) == 0.0
    fluid.begin_step(0.1, 0.1)
    assert share(0.5 * SLIT) == pytest.approx(0.5 * SLIT)


@pytest.mark.parametrize(("scheme", "opens"), [("backward_euler", True), ("steady", False)])
def test_a_slit_that_was_closed_may_open(scheme, opens):
    """In time: fluid that enters has a history. A steady flow has none, and keeps it closed."""
    fluid, share = between_blocks(0.43, scheme)
    share(-0.01)
    fluid.begin_step(0.0, 0.1)
    assert share(-0.01) == 0.0
    assert share(0.5 * SLIT) == pytest.approx(0.5 * SLIT if opens else 0.0)
