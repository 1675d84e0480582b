"""Periodic faces and faces with a given pressure: exact flows to round-off; a period may begin anywhere."""

import numpy as np
import pytest
from advised import require_advice
from fluid_setup import block, body, circle, field, loop, make_fluid, nodal_errors, solve_steady, step

from solvers.api import FailureKind, StepFailed
from solvers.fluid.flow.conservation.regions import RegionsOfCut
from solvers.fluid.flow.conservation.volume_balance import VolumeBalance
from solvers.fluid.flow.probes import at_point, on_patch
from solvers.fluid.flow.snapshot import snapshots
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.terms.boundary.patches import Patch

GRADED = Grid((np.array([0, 0.5, 0.8, 1.5, 2.2, 3.0]), np.array([0, 0.2, 0.6, 0.8, 1.0])))
ENDS = Patch("ends", ("x-", "x+"), "periodic")
WALLS = Patch("walls", ("y-", "y+"), "no_slip")


def given(pressure):
    return (lambda x, t: pressure + 0.0 * x[0],)


def poiseuille(x, t):
    return 5.0 * x[1] * (1.0 - x[1])


def still(x, t):
    return 0.0 * x[0]


@pytest.mark.parametrize("scheme", ["steady", "bdf2"])
def test_body_force_drives_a_periodic_channel(scheme):
    """u = f / (2 mu) y (1 - y), p = 0."""
    fluid = make_fluid(
        GRADED, [ENDS, WALLS], element="q2q1", mu=0.1, scheme=scheme, body_force=field(1, 0),
        initial_velocity=None if scheme == "steady" else (poiseuille, still),
    )  # fmt: skip
    for number in range(1 if scheme == "steady" else 4):
        step(fluid, 0.1 * number, 0.1)
    u, p = nodal_errors(fluid, (poiseuille, still), still, 0.0, level=True)
    assert u < 1e-13
    assert p < 1e-12
    # through a period is what passes its end
    assert on_patch(fluid, "flow_rate", "ends")()[""] == pytest.approx(5 / 6, rel=1e-13)
    assert abs(VolumeBalance(fluid, RegionsOfCut(fluid)).numbers()["fluid.mass"]) < 1e-13
    for x in (0.0, 0.1, 2.9, 3.0):
        found = at_point(fluid, "velocity", (x, 0.3), 0.0)()
        assert list(found.values()) == pytest.approx([5 * 0.3 * 0.7, 0.0], abs=1e-13)
    shown = snapshots(fluid)[0]
    assert np.abs(shown.point_data["velocity"][:, 0] - poiseuille(shown.points.T, 0)).max() < 1e-13


@pytest.mark.parametrize("scheme", ["steady", "bdf2"])
def test_pressure_drives_a_channel(scheme):
    """The pressure falls from 3 to 0 over a length of 3; the flow enters and leaves along the normal."""
    patches = [
        Patch("in", ("x-",), "pressure", given(3.0)),
        Patch("out", ("x+",), "pressure", given(0.0)),
        WALLS,
    ]
    fluid = make_fluid(
        GRADED, patches, element="q2q1", mu=0.1, scheme=scheme,
        initial_velocity=None if scheme == "steady" else (poiseuille, still),
    )  # fmt: skip
    for number in range(1 if scheme == "steady" else 4):
        step(fluid, 0.1 * number, 0.1)
    u, p = nodal_errors(fluid, (poiseuille, still), lambda x, t: 3.0 - x[0], 0.0)
    assert u < 1e-13
    assert p < 1e-13
    assert on_patch(fluid, "flow_rate", "out")()[""] == pytest.approx(5 / 6, rel=1e-13)
    assert on_patch(fluid, "pressure", "in")()[""] == pytest.approx(3.0, rel=1e-13)


def test_pressure_in_space():
    """Hydrostatic fluid between faces with the pressure of its height, all of its other sides closed."""
    patches = [
        Patch("top", ("z+",), "pressure", given(7.0)),
        Patch("bottom", ("z-",), "pressure", given(27.0)),
        Patch("sides", ("x-", "x+", "y-", "y+"), "no_slip"),
    ]
    fluid = make_fluid(uniform([0, 0, 0], [1, 1, 2], [2, 2, 2]), patches, scheme="steady", body_force=field(0, 0, -10))
    solve_steady(fluid)
    u, p = nodal_errors(fluid, (still, still, still), lambda x, t: 27.0 - 10.0 * x[2], 0.0)
    assert u < 1e-12
    assert p < 1e-11


def test_two_periods_in_space():
    """Flow between plates of which one slides, at an angle to both periods: linear, and so exact for q1q1."""
    lid = Patch("lid", ("y+",), "velocity", field(1, 0, 0.5))
    patches = [Patch("ends", ("x-", "x+", "z-", "z+"), "periodic"), Patch("floor", ("y-",), "no_slip"), lid]
    fluid = make_fluid(uniform([0, 0, 0], [2, 1, 1], [3, 3, 2]), patches, scheme="steady")
    solve_steady(fluid)
    u, p = nodal_errors(fluid, (lambda x, t: x[1], still, lambda x, t: 0.5 * x[1]), still, 0.0, level=True)
    assert u < 1e-13
    assert p < 1e-12


def disc_in_period(shift, element):
    """A disc that moves with respect to a periodic channel, some cells further along it."""
    grid = uniform([0, 0], [2, 1], [16, 8])
    place = circle((0.61 + shift / 8, 0.47), 0.2, 24)
    disc = body("disc", place, loop(24), motion=lambda x, t: (x + np.array([0, 0.1 * t]), 0 * x + [0, 0.1]))
    fluid = make_fluid(grid, [ENDS, WALLS], [disc], element=element, mu=0.05, dt=0.1, body_force=field(1, 0))
    for number in range(3):
        step(fluid, 0.1 * number, 0.1)
    return fluid


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_a_period_begins_anywhere(element):
    """Shifted by whole cells, the body feels the same and the flow is the same, shifted."""
    one, other = (disc_in_period(shift, element) for shift in (0, 5))
    assert other.force()["disc"].sum(axis=0) == pytest.approx(one.force()["disc"].sum(axis=0), rel=1e-9)
    for x in ((0.05, 0.3), (1.3, 0.5), (1.31, 0.9), (2.0, 0.5)):
        moved = ((x[0] + 5 / 8) % 2.0, x[1])
        for quantity in ("velocity", "pressure"):
            values = [list(at_point(f, quantity, at, 0.0)().values()) for f, at in ((one, x), (other, moved))]
            if quantity == "velocity":
                assert values[1] == pytest.approx(values[0], abs=1e-10)
    gradients = []
    for fluid, shift in ((one, 0.0), (other, 5 / 8)):
        ends = [at_point(fluid, "pressure", ((x + shift) % 2.0, 0.5), 0.0)()[""] for x in (0.1, 1.4)]
        gradients.append(ends[1] - ends[0])
    assert gradients[1] == pytest.approx(gradients[0], rel=1e-8)
    assert abs(VolumeBalance(one, RegionsOfCut(one)).numbers()["fluid.mass"]) < 1e-9


def test_fluid_on_both_sides_of_a_plug_is_one():
    """Over the end of the period: one level of the pressure, which rises all the way from one side to the other."""
    plug = body("plug", *block([0.9, -0.1], [1.3, 1.1]))
    fluid = make_fluid(
        uniform([0, 0], [2, 1], [10, 4]), [ENDS, WALLS], [plug], scheme="steady", convection=False,
        body_force=field(10, 0),
    )  # fmt: skip
    solve_steady(fluid)

    def pressure(x, t):
        return 10.0 * np.where(x[0] > 1.1, x[0], x[0] + 2.0)

    u, p = nodal_errors(fluid, (still, still), pressure, 0.0, level=True)
    assert u < 1e-11
    assert p < 1e-9


def test_bodies_stay_within_the_period():
    points = circle((1.5, 0.5), 0.2, 16)
    disc = body("disc", points, loop(16), motion=lambda x, t: (x + np.array([t, 0]), 0 * x + [1, 0]))
    fluid = make_fluid(uniform([0, 0], [2, 1], [16, 8]), [ENDS, WALLS], [disc], dt=0.1)
    step(fluid, 0.0, 0.1)
    with pytest.raises(StepFailed, match="a body reaches the periodic faces x- and x\\+") as failed:
        step(fluid, 0.1, 0.1)
    require_advice(failed.value, FailureKind.PERIODIC_FACES)
