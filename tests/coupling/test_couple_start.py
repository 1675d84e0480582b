"""Which facets are wet is found where the bodies are at the first time of the run."""

import numpy as np
import pytest

from coupling import couple
from fsci.shapes import rectangle
from solvers.fluid import FlowSettings, Patch, rigid_body, uniform
from solvers.structure import Body, Structure, StVenantKirchhoff

SQUARE = np.array([[0.4, 0.4], [0.8, 0.4], [0.8, 0.8], [0.4, 0.8]])
LOOP = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
ALONG = np.array([1.0, 0.0])


@pytest.mark.parametrize(("start", "dry"), [(0.0, True), (1.0, False)])
def test_wet_facets_of_bodies_that_meet_at_another_time(start, dry):
    """The right half of the block is in the square at t = 0, nothing of it at t = 1."""
    block = Body("block", rectangle([0.4, 0.2], [4, 2], origin=[0.2, 0.5]), StVenantKirchhoff(1.0, 1.0, 1.0))
    moves = rigid_body("square", SQUARE, LOOP, lambda t: (SQUARE + 2.0 * t * ALONG, 0.0 * SQUARE + 2.0 * ALONG))
    patches = [Patch("walls", ["x-", "x+", "y-", "y+"], "no_slip")]
    coupled = couple(
        Structure([block]), uniform([0.0, 0.0], [4.0, 1.0], [40, 10]), FlowSettings(1.0, 1.0), patches,
        rigid_bodies=[moves], start=start,
    )  # fmt: skip
    wet = {body.surface.name: body.surface.wet for body in coupled.flow.bodies}["block"]
    assert wet is not None
    assert wet.all() != dry
    assert np.count_nonzero(~wet) == (6 if dry else 0)
