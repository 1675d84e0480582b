"""Periodic faces and faces with a given pressure: exact flows to round-off; a period may begin anywhere."""

import numpy as np
import pytest
import ufl
from advised import require_advice
from fluid_setup import block, body, circle, field, loop, make_fluid, nodal_errors, solve_steady, step

from solvers.api import FailureKind, StepFailed
from solvers.fluid.cut.images import Periods
from solvers.fluid.flow.conservation.regions import RegionsOfCut
from solvers.fluid.flow.conservation.volume_balance import VolumeBalance
from solvers.fluid.flow.probes import at_point, on_patch
from solvers.fluid.flow.snapshot import snapshots
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.surfaces.inside import PointInBody
from solvers.fluid.terms import forms
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.boundary.windkessel import Windkessel

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


@pytest.mark.parametrize(
    "shift", [5, pytest.param(10, marks=pytest.mark.slow), 11, pytest.param(16, marks=pytest.mark.slow), -67]
)
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_a_period_begins_anywhere(element, shift):
    """Shifted by whole cells, the body feels the same and the flow is the same, shifted, also across the end."""
    one, other = (disc_in_period(cells, element) for cells in (0, shift))
    assert other.force()["disc"].sum(axis=0) == pytest.approx(one.force()["disc"].sum(axis=0), rel=1e-9)
    for x in ((0.05, 0.3), (1.3, 0.5), (1.31, 0.9), (2.0, 0.5)):
        moved = ((x[0] + shift / 8) % 2.0, x[1])
        values = [list(at_point(f, "velocity", at, 0.0)().values()) for f, at in ((one, x), (other, moved))]
        assert values[1] == pytest.approx(values[0], abs=1e-10)
    gradients = []
    for fluid, way in ((one, 0.0), (other, shift / 8)):
        ends = [at_point(fluid, "pressure", ((x + way) % 2.0, 0.5), 0.0)()[""] for x in (0.1, 1.4)]
        gradients.append(ends[1] - ends[0])
    assert gradients[1] == pytest.approx(gradients[0], rel=1e-8)
    assert abs(VolumeBalance(other, RegionsOfCut(other)).numbers()["fluid.mass"]) < 1e-9
    with pytest.raises(PointInBody, match="the point is in body 'disc'"):
        at_point(other, "velocity", ((0.61 + shift / 8) % 2.0, 0.47), 0.0)
    at_edge = at_point(other, "velocity", ((0.61 + shift / 8) % 2.0, 0.47 + 0.215), 0.0)
    assert np.isnan(list(at_edge().values())).all()  # the disc has come there


def test_a_term_of_the_ghost_penalty_acts_at_the_end_of_a_period(monkeypatch):
    """One that is added in `forms` alone: the disc feels the same there as elsewhere, and not what it feels without."""
    own, (without, found) = forms.ghost_penalty, (disc_in_period(0, "q1q1").force()["disc"].sum(axis=0), [])

    def with_more(flow, factors, scales, u, p, v, q):
        more = 0.01 * ufl.jump(ufl.grad(p))[0] * ufl.jump(ufl.grad(v[1]))[0]
        return own(flow, factors, scales, u, p, v, q) + more

    monkeypatch.setattr(forms, "ghost_penalty", with_more)
    for shift in (0, 11):  # the second disc is in two halves at the ends
        found.append(disc_in_period(shift, "q1q1").force()["disc"].sum(axis=0))
    assert found[1] == pytest.approx(found[0], rel=1e-9)
    assert np.abs(found[0] - without).max() > 1e-4 * np.abs(without).max()


def two_discs(shift, element, speed=0.5):
    """Two discs, a gap of a tenth of a cell apart, of which one moves along a periodic channel, some cells further."""
    grid = uniform([0, 0], [2, 1], [16, 8])
    places = [circle((x + shift / 8, y), 0.15, 22) for x, y in ((0.85, 0.47), (1.1625, 0.5))]
    moves = (lambda x, t: (x + np.array([speed * t, 0]), 0 * x + [speed, 0])), None
    bodies = [body(name, x, loop(22), motion=m) for name, x, m in zip("ab", places, moves, strict=True)]
    fluid = make_fluid(grid, [ENDS, WALLS], bodies, element=element, mu=0.05, dt=0.002, narrow_gaps=element == "q1q1")
    for number in range(3):
        step(fluid, 0.002 * number, 0.002)
    return fluid


@pytest.mark.parametrize("shift", [8, 9, 16])
@pytest.mark.parametrize(("element", "scatter"), [("q1q1", 1e-8), ("q2q1", 1e-3)])
def test_a_narrow_gap_at_the_end_of_a_period(element, scatter, shift):
    """Films and gaps between bodies on both sides of the end are those of the same bodies in the middle.

    In a film with q2q1, rounding of positions changes forces by 5e-4 within the period, too.
    """
    one, other = (two_discs(cells, element) for cells in (0, shift))
    assert (one.cut.gaps if element == "q1q1" else one.cut.film) is not None
    for name, force in one.force().items():
        total = force.sum(axis=0)
        assert np.linalg.norm(other.force()[name].sum(axis=0) - total) < scatter * np.linalg.norm(total)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_two_periods_with_a_body_each_are_one(element):
    """An array of discs: in a box of one period with one disc, and of two periods with two, all across the ends."""
    forces = []
    for count in (1, 2):
        place = [circle((1.9 + 2 * k, 0.47), 0.2, 24) for k in range(count)]
        bodies = [body(f"d{k}", x, loop(24)) for k, x in enumerate(place)]
        grid = uniform([0, 0], [2 * count, 1], [16 * count, 8])
        fluid = make_fluid(grid, [ENDS, WALLS], bodies, element=element, mu=0.05, dt=0.1, body_force=field(1, 0))
        for number in range(3):
            step(fluid, 0.1 * number, 0.1)
        forces += [force.sum(axis=0) for force in fluid.force().values()]
    for force in forces[1:]:
        assert force == pytest.approx(forces[0], rel=1e-8)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_a_ball_across_an_edge_of_two_periods(element):
    """The steady Stokes drag of a cubic block in the middle of the box, and on the edge where two periods end."""
    ends = Patch("ends", ("x-", "x+", "z-", "z+"), "periodic")
    floor = Patch("walls", ("y-", "y+"), "no_slip")
    forces = []
    for cells in (0, 3):
        ball = turned_block(np.array([0.45 + cells / 6, 0.55, 0.48 + cells / 6]))
        fluid = make_fluid(
            uniform([0, 0, 0], [1, 1, 1], [6, 6, 6]), [ends, floor], [ball], element=element, scheme="steady",
            convection=False, body_force=field(1, 0, 0.3),
        )  # fmt: skip
        solve_steady(fluid)
        forces.append(fluid.force()["ball"].sum(axis=0))
    assert forces[1] == pytest.approx(forces[0], rel=1e-8)
    assert forces[0][0] > 0.1


def turned_block(middle):
    """A block with oblique sides."""
    x = np.array([[a, b, c] for c in (-1, 1) for b in (-1, 1) for a in (-1, 1)]) * 0.16
    turn = np.linalg.qr(np.array([[1, 0.3, 0.2], [-0.2, 1, 0.4], [0.1, -0.3, 1]]))[0]
    turn *= np.sign(np.linalg.det(turn))
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    facets = [[q[i], q[j], q[k]] for q in quads for i, j, k in ((0, 1, 2), (0, 2, 3))]
    return body("ball", middle + x @ turn.T, np.array(facets))


@pytest.mark.parametrize("start", [0.9, 1.75, 1.6, 2.0, -6.0])
def test_fluid_on_both_sides_of_a_plug_is_one(start):
    """One level of the pressure, which rises all the way from one side to the other. The plug is in the period, or

    across its end, or has a side in it.
    """
    plug = body("plug", *block([start, -0.1], [start + 0.4, 1.1]))
    fluid = make_fluid(
        uniform([0, 0], [2, 1], [10, 4]), [ENDS, WALLS], [plug], scheme="steady", convection=False,
        body_force=field(10, 0),
    )  # fmt: skip
    solve_steady(fluid)

    def pressure(x, t):
        return 10.0 * ((x[0] - start - 0.2) % 2.0)

    u, p = nodal_errors(fluid, (still, still), pressure, 0.0, level=True)
    assert u < 1e-11
    assert p < 1e-9


def test_thin_bodies_stay_within_the_period():
    """Cells of the two sides of a thin body are not joined across the end."""
    plate = body("plate", *block([1.4, 0.43], [2.6, 0.45]))
    with pytest.raises(
        StepFailed, match="a thin body, or another one beside thin bodies, reaches the periodic faces"
    ) as failed:
        make_fluid(uniform([0, 0], [2, 1], [16, 8]), [ENDS, WALLS], [plate], dt=0.1)
    require_advice(failed.value, FailureKind.PERIODIC_FACES)


@pytest.mark.parametrize(("length", "fits"), [(1.99, True), (2.0, False), (2.5, False)])
def test_a_body_as_long_as_the_period(length, fits):
    """It would meet its own image."""
    points, facets = block([-0.9, 0.3], [length - 0.9, 0.7])
    periods = Periods(uniform([0, 0], [2, 1], [16, 8]), (0,))
    if fits:
        assert len(periods.images(facets, points, 1).facets) == 2 * len(facets)
        return
    with pytest.raises(StepFailed, match="a body is as long as the period between x- and x\\+") as failed:
        periods.images(facets, points, 1)
    require_advice(failed.value, FailureKind.PERIODIC_FACES)


@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow)])
def test_a_disc_moves_through_the_end(element):
    """At each of 30 positions, a tenth of a cell apart and more, its force is that of a disc within the period."""
    histories = []
    for start in (0.75, 1.75):
        place = circle((start, 0.47), 0.1, 22)
        disc = body("disc", place, loop(22), motion=lambda x, t: (x + np.array([t, 0]), 0 * x + [1, 0]))
        grid = uniform([0, 0], [2, 1], [16, 8])
        fluid = make_fluid(grid, [ENDS, WALLS], [disc], element=element, mu=0.05, dt=0.02)
        found = []
        for number in range(30):
            step(fluid, 0.02 * number, 0.02)
            found.append(fluid.force()["disc"].sum(axis=0))
        histories.append(np.array(found))
    assert np.abs(histories[1] - histories[0]).max() < 1e-10 * np.abs(histories[0]).max()


@pytest.mark.parametrize("kind", ["outflow", "resistance"])
def test_a_force_along_the_period_beside_an_outflow(kind):
    """u = f / mu (y - y^2 / 2) below a face without shear stress: a periodic pressure balances no such force."""
    outlet = Windkessel(3.0) if kind == "resistance" else None
    patches = [ENDS, Patch("floor", ("y-",), "no_slip"), Patch("top", ("y+",), kind, outlet=outlet)]
    fluid = make_fluid(GRADED, patches, element="q2q1", mu=0.1, scheme="steady", body_force=field(1, -7))
    solve_steady(fluid)
    exact = (lambda x, t: 10.0 * (x[1] - 0.5 * x[1] ** 2), still)
    u, p = nodal_errors(fluid, exact, lambda x, t: 7.0 * (1.0 - x[1]), 0.0)
    assert u < 1e-12
    assert p < 1e-11
