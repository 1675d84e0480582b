"""The sentinel of volumes: what the fluid loses, and what passes through walls."""

from dataclasses import replace

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, step

from solvers.fluid.flow.conservation.regions import RegionsOfCut
from solvers.fluid.flow.conservation.volume_balance import VolumeBalance
from solvers.fluid.flow.conservation.volumes import Volumes
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

OUT = Patch("out", ("x+",), "outflow")
SLIP = Patch("slip", ("y-", "y+"), "slip")


def sentinel_of(fluid):
    regions = RegionsOfCut(fluid)
    return Volumes(fluid, regions, VolumeBalance(fluid, regions))


def look_at(fluid, steps=2, dt=0.1):
    """Findings in the last of some steps."""
    sentinel, found = sentinel_of(fluid), []
    for number in range(steps):
        step(fluid, number * dt, dt)
        found = sentinel.look((number + 1) * dt, dt)
    return found


def inflow(value=1.0):
    return Patch("in", ("x-",), "velocity", field(value, 0.0))


def plate(low, high, *, wet=None, speed=0.0):
    points, facets = block(low, high)
    v = np.array([speed, 0.0])
    motion = (lambda x, t: (x + t * v, 0.0 * x + v)) if speed else None
    return body("plate", points, facets, motion=motion, wet=wet)


def flow(patches, bodies=(), cells=(20, 10), **settings):
    return make_fluid(uniform([0, 0], [2, 1], cells), patches, bodies, mu=0.1, dt=0.1, **settings)


@pytest.mark.parametrize("scheme", ["bdf2", "steady"])
def test_inflow_that_cannot_leave(scheme):
    shut = flow([inflow(), OUT, SLIP], [plate([0.93, -0.2], [1.33, 1.2])], scheme=scheme)
    (found,) = look_at(shut)
    assert (found.kind, found.body) == ("mass", "fluid")
    assert found.value == pytest.approx(-0.2, rel=1e-9)
    assert found.where == pytest.approx((0.5, 0.5), abs=0.05)
    assert "0.2 [volume] of fluid were lost around (" in found.message
    assert "This part of the fluid has no open patch" in found.message
    assert look_at(flow([inflow(), OUT, SLIP], [plate([0.93, -0.2], [1.33, 0.7])], scheme=scheme)) == []


def test_a_closed_box_without_bodies():
    box = Patch("box", ("x+", "y-", "y+"), "no_slip")
    (found,) = look_at(flow([box, inflow()]))
    assert (found.kind, found.where) == ("mass", None)
    both = field(1.0, 0.0)
    assert look_at(flow([Patch("all", ("x-", "x+", "y-", "y+"), "velocity", both)])) == []


def test_fluid_that_vanishes_in_a_dry_surface():
    """A plate whose front is dry, though fluid flows against it."""
    wet = np.array([True, True, True, False])  # below, behind, above, in front
    (found,) = look_at(flow([inflow(), OUT, SLIP], [plate([0.93, -0.2], [1.33, 0.5], wet=wet)]))
    assert found.kind == "mass"
    assert "'coupling.wetted'" in found.message
    assert look_at(flow([inflow(), OUT, SLIP], [plate([0.93, -0.2], [1.33, 0.5])])) == []


def test_cells_that_do_not_separate_both_sides_of_a_plate():
    """Both sides of a plate of two to four cells that may touch others share unknowns if it closes a channel later."""
    grid = uniform([0, 0], [2, 1], [20, 10])
    patches = [Patch("in", ("x-",), "traction", field(1.0, 0.0)), OUT, SLIP]

    def found(top):
        def rises(x, t):
            return x + np.array([0.0, min(t, 0.2)]), 0.0 * x + np.array([0.0, float(t < 0.2 + 1e-9)])

        gate = body("gate", *block([0.73, -0.4], [1.03, top]), motion=rises)
        gate = replace(gate, surface=replace(gate.surface, in_contact=np.ones(4, dtype=bool)))
        return look_at(make_fluid(grid, patches, [gate], mu=0.001, dt=0.1), steps=6)

    (leak,) = found(0.93)
    assert (leak.kind, leak.body) == ("leak", "'gate'")
    assert "of fluid have passed through 'gate'" in leak.message
    assert found(1.2) == []


def test_at_rest_rounding_errors_are_no_losses():
    weight = field(0.0, -1.0)
    shelf = plate([0.53, 0.31], [1.33, 0.52])
    assert (
        look_at(
            flow(
                [Patch("top", ("y+",), "outflow"), Patch("box", ("x-", "x+", "y-"), "no_slip")],
                [shelf],
                body_force=weight,
            )
        )
        == []
    )


def test_a_restored_state_goes_on():
    fluid = flow([inflow(), OUT, SLIP], [plate([0.93, -0.2], [1.33, 1.2])])
    one, other = sentinel_of(fluid), sentinel_of(fluid)
    step(fluid, 0.0, 0.1)
    one.look(0.1, 0.1)
    other.restore(one.save())
    step(fluid, 0.1, 0.1)
    assert one.look(0.2, 0.1) == other.look(0.2, 0.1) != []
