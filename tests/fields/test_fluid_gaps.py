"""First-order velocities in gaps of a few cells: the parabola that they lack is part of the continuity equation."""

import numpy as np
import pytest
from fluid_setup import (
    block,
    body,
    circle,
    field,
    loop,
    make_fluid,
    nodal_errors,
    solve_steady,
    step,
    turned,
    wall,
    with_slip,
)
from lubrication import closing_ratios, cylinder_drag, drag_ratio, slip_ratio, stretched
from test_fluid_cut_shape import Moving
from test_fluid_film import plate, scene
from test_fluid_slip_bodies import along, half_space

from solvers.fluid.cut import gaps
from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.settings.penalties import TRACE, Penalties
from solvers.fluid.terms.boundary.patches import Patch

H = 0.1


def wide_plate(name, low, high, angle):
    """A plate that leaves the box on both sides, turned about the middle."""
    points, facets = block([-1.0, low], [2.0, high])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return body(name, (points - 0.5) @ turn.T + 0.5, facets)


def gaps_of(*bodies, **settings):
    return scene(*bodies, element="q1q1", narrow_gaps=True, **settings).cut.gaps


# ------------------------------------------------------------------------------------------------- where gaps are


@pytest.mark.parametrize("gap", [0.19, 0.1, 0.05, 0.02])
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, 2.0])
@pytest.mark.parametrize("low", [0.43, 0.5, 0.478])
def test_between_two_bodies(gap, angle, low):
    """The gap along the normal, wherever the grid is, in all cells between the walls."""
    found = gaps_of(wide_plate("lower", low - 2.0, low, angle), wide_plate("upper", low + gap, low + 2.0, angle))
    n = np.array([-np.sin(angle), np.cos(angle)])
    along, across = np.meshgrid(np.linspace(-0.1, 0.1, 9), np.linspace(1e-6, gap - 1e-6, 9))
    x = 0.5 + along[..., None] * [n[1], -n[0]] + (across + low - 0.5)[..., None] * n
    inside = np.unique((x.reshape(-1, 2) / H).astype(int) @ [1, 10])
    at = np.searchsorted(found.cells, inside)
    assert np.array_equal(found.cells[at], inside)
    assert found.height[at] == pytest.approx(gap / H, rel=1e-6)
    assert found.tangents[at] == pytest.approx(np.tile(np.eye(2) - np.outer(n, n), (len(at), 1, 1)), abs=1e-12)


def test_between_a_body_and_a_face_of_the_box():
    for gap in (0.24, 0.03):
        assert gaps_of(plate("plate", gap, 0.6)).height.min() == pytest.approx(gap / H, rel=1e-6)
        assert gaps_of(plate("plate", 0.4, 1 - gap)).height.min() == pytest.approx(gap / H, rel=1e-6)
        assert gaps_of(plate("plate", gap, 0.6), walls=("y+",)) is None  # y- is open


def test_no_gap():
    """Not across the solid of a thin body, not where walls are 2.5 cells apart, not with second order."""
    assert gaps_of(plate("thin", 0.43, 0.46)) is None
    assert gaps_of(plate("lower", 0.26, 0.43), plate("upper", 0.6801, 0.74)) is None
    assert gaps_of(body("disc", circle([0.5, 0.5], 0.24, 100), loop(100))) is None
    assert (
        scene(plate("lower", 0.2, 0.43), plate("upper", 0.45, 0.7), element="q2q1", narrow_gaps=True).cut.gaps is None
    )


def test_shares_are_those_of_the_module():
    """Slip with Nitsche's penalty k mu / g; the ghost penalty of the pressure relative to the film."""
    factors = Penalties()
    between = gaps_of(plate("lower", 0.2, 0.43), plate("upper", 0.48, 0.7))
    at_face = gaps_of(plate("plate", 0.03, 0.5))
    k = factors.nitsche * TRACE[2, 1]
    assert between.slip[np.argmin(between.height)] == pytest.approx(6.0 / k)
    assert at_face.slip[np.argmin(at_face.height)] == pytest.approx(3.0 / (k - 1.0))
    for found, g in ((between, 0.5), (at_face, 0.3)):
        assert 12.0 * factors.ghost_pressure * found.pressure.min() / g**3 == pytest.approx(
            gaps.SHARE_OF_FLOW, rel=1e-6
        )


# -------------------------------------------------------------------------------------------------- flow and drag


def through(gap, place, angle=0.0, length=2.5):
    """Flow rate through a gap (in cells of 1/12) between two basins over G g^3 / (12 mu); `place` above a plane."""
    h, mu, low = 1.0 / 12, 0.7, (4 + place) / 12
    x = (0.513, 0.513 + length)
    bodies = [
        body("lower", *block([x[0], -1.0], [x[1], low])),
        body("upper", *block([x[0], low + gap * h], [x[1], 2.0])),
    ]
    patches = [
        Patch("in", ("x-",), "pressure", (lambda x, t: np.ones(x.shape[1]),)),
        Patch("out", ("x+",), "pressure", (lambda x, t: np.zeros(x.shape[1]),)),
        Patch("walls", ("y-", "y+"), "no_slip"),
    ]
    grid = uniform([0, 0], [length + 1, 1], [round((length + 1) * 12), 12])
    fluid = make_fluid(
        grid, patches, bodies, mu=mu, element="q1q1", scheme="steady", convection=False, narrow_gaps=True
    )
    solve_steady(fluid)
    return flow_rate(fluid)(["out"]) / ((gap * h) ** 3 / (12 * mu) / length)


@pytest.mark.parametrize(
    "gap", [1, pytest.param(0.7, marks=pytest.mark.slow), 0.5, pytest.param(0.25, marks=pytest.mark.slow), 0.1, 0.05]
)
def test_flow_through_a_gap(gap):
    """Within 6 %, 3 % of it at both ends, wherever the gap is in the grid; 0.12 to 1.24 without the term."""
    ratios = np.array([through(gap, place) for place in (0.0, 0.13, 0.31, 0.5, 0.77, 0.95)])
    assert np.abs(ratios - 1.0).max() < 0.06, ratios


def test_flow_through_a_gap_in_one_row_of_cells():
    """Without the ends: by the difference of two lengths, within 1.5 %."""
    for gap, place in ((0.9, 0.05), (0.5, 0.0), (0.5, 0.31), (0.25, 0.7), (0.1, 0.13)):
        resistance = [length / through(gap, place, length=length) for length in (1.0, 2.5)]
        assert resistance[1] - resistance[0] == pytest.approx(1.5, rel=0.015)


@pytest.mark.parametrize("element", ["q1q1"])
@pytest.mark.parametrize("slip", [0.0, 0.03])
@pytest.mark.parametrize(("angle", "low", "high"), [(0.0, -0.13, -0.07), (0.4, -0.02, 0.03), (np.pi / 4, -0.2, 0.1)])
def test_walls_that_slide_along_each_other(element, slip, angle, low, high):
    """Couette's flow stays exact in a gap of 0.25 to 1.3 cells, with slip too."""
    u = along(angle, lambda d: (d - low + slip) / (high - low + 2.0 * slip))
    speed = np.array([np.cos(angle), np.sin(angle)])
    bodies = [half_space("low", 2, angle, low, -1), half_space("high", 2, angle, high, 1, speed)]
    bodies = [with_slip(some, slip) for some in bodies]
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [5, 4]), [wall(u)], bodies, element=element, scheme="steady", mu=0.7, narrow_gaps=True
    )
    solve_steady(fluid)
    assert fluid.cut.gaps is not None
    assert nodal_errors(fluid, u, field(0)[0], 0.0, level=True)[0] < 1e-9


@pytest.mark.parametrize("gap", [2, 1.5, 1, 0.7, 0.5, 0.2, 0.1])
def test_cylinder_at_a_wall(gap):
    """Within 14 %; without the term 1.08, 1.17, 1.37, 1.53, 1.33, 0.63, 0.28."""
    assert drag_ratio(2, gap * H, H, "q1q1", narrow_gaps=True) == pytest.approx(1.0, abs=0.14)


def inclined(gap, h, angle, shift):
    """Computed over exact drag of a cylinder that approaches an inclined wall in cells of the size h."""
    n, offset = np.array([-np.sin(angle), np.cos(angle)]), shift * h * np.array([0.31, 0.53])
    points, facets = block([-20, -20], [20, 0])
    half = stretched(h, 0.8, 5.0, 1.25)
    edge = np.concatenate([-half[:0:-1], half])
    disc = circle((1.0 + gap) * n + offset, 1.0, 2000)
    bodies = [
        body("wall", turned(points, angle, [0.0, 0.0]) + offset, facets),
        body("disc", disc, loop(2000), velocity=-n),
    ]
    free = Patch("free", ("x-", "x+", "y-", "y+"), "traction", field(0, 0))
    fluid = make_fluid(
        Grid((edge, edge)), [free], bodies, element="q1q1", scheme="steady", convection=False, narrow_gaps=True
    )
    solve_steady(fluid)
    return float(fluid.force()["disc"].sum(axis=0) @ n / cylinder_drag(gap))


@pytest.mark.parametrize("gap", [1, 0.5, 0.2])
@pytest.mark.parametrize(
    ("angle", "shift", "most"), [(0.0, 0.0, 0.13), (0.0, 0.7, 0.1), (0.3, 0.5, 0.1), (1.1, 1.0, 0.1)]
)
def test_cylinder_at_a_wall_across_the_grid(gap, angle, shift, most):
    assert inclined(gap * H, H, angle, shift) == pytest.approx(1.0, abs=most)


def test_cylinder_in_motion():
    """Its gap closes as h exp(-t). The cells behind its surface, which the next steps uncover, do not open the film."""
    ratios = np.array(closing_ratios(H, 24, 0.1, element="q1q1", narrow_gaps=True))
    assert ratios[-1, 0] < 0.1
    assert ratios[:, 1] == pytest.approx(1.0, abs=0.15)
    assert np.abs(np.diff(ratios[:, 1])).max() < 0.04  # it falls from 1.15 to 0.95, without jumps


@pytest.mark.parametrize(
    "gap", [pytest.param(1, marks=pytest.mark.slow), pytest.param(0.5, marks=pytest.mark.slow), 0.2]
)
def test_sphere_at_a_wall(gap):
    """Within 14 %; without the term 1.23 and 1.44."""
    ratio = drag_ratio(3, gap * H, H, "q1q1", growth=1.3, fine=0.6, size=5.0, narrow_gaps=True)
    assert ratio == pytest.approx(1.0, abs=0.14)


@pytest.mark.parametrize("gap", [0.1, 0.05, 0.02])
def test_cylinder_with_slip_on_both_walls(gap):
    """Slip adds to the flow of the parabola."""
    assert slip_ratio(2, gap, H, "q1q1", 0.01, narrow_gaps=True) == pytest.approx(1.0, abs=0.15)


def test_pressure_is_smooth_along_the_film():
    """It falls from the middle to both sides, and no node is off the mean of its neighbours by more than 4 %."""
    points, facets = circle([0.03, 1.02], 1.0, 2000), loop(2000)
    side = stretched(H, 1.0, 4.0, 1.15)
    grid = Grid((np.concatenate([-side[:0:-1], side]), side))
    free = Patch("free", ("x-", "x+", "y+"), "traction", field(0, 0))
    disc = body("disc", points, facets, velocity=np.array([0.0, -1.0]))
    patches = [free, Patch("wall", ("y-",), "no_slip")]
    fluid = make_fluid(grid, patches, [disc], element="q1q1", scheme="steady", convection=False, narrow_gaps=True)
    solve_steady(fluid)
    nodes = fluid.unknowns.pressure
    at_wall = np.flatnonzero((nodes.points[:, 1] < 1e-9) & (np.abs(nodes.points[:, 0]) < 0.75))
    at_wall = at_wall[np.argsort(nodes.points[at_wall, 0])]
    p = fluid.flow[nodes.dofs[at_wall, 0]]
    top = int(np.argmax(p))
    assert np.all(np.diff(p[: top + 1]) > 0)
    assert np.all(np.diff(p[top:]) < 0)


# ---------------------------------------------------------------------------------------- the rest of the program


def moving(speed):
    """A disc of a radius of 2.2 cells that moves in a channel of 10 cells, in time and with convection."""
    down = np.array([0.0, speed])
    return scene(
        body("disc", circle([0.5, 0.5], 0.22, 100), loop(100), motion=lambda x, t: (x + t * down, 0 * x + down)),
        element="q1q1", scheme="bdf2", convection=True, dt=0.02, mu=0.1, narrow_gaps=True,
    )  # fmt: skip


def test_flow_without_gaps_is_the_same_bit_for_bit():
    """As without the search, and the forms of gaps are not even compiled."""
    flows = []
    for finds in (True, False):
        fluid = moving(0.1)
        if not finds:
            fluid.parts.cutter.gaps = None
        for number in range(3):
            step(fluid, 0.02 * number, 0.02)
        assert fluid.cut.gaps is None
        forms = fluid.system.forms
        assert all(form.compiled is None for form in (*forms.residuals[2:], *forms.tangents[2:]))
        flows.append(fluid.flow.copy())
    assert np.array_equal(*flows)


def test_gaps_are_those_of_the_first_cut_of_a_step():
    fluid = moving(-0.4)
    step(fluid, 0.0, 0.02)
    before = fluid.moving.motions[0]
    for number in range(1, 12):
        step(fluid, 0.02 * number, 0.02)
    cutter, facets = fluid.parts.cutter, fluid.cut.facets
    cutter.begin_step()
    assert cutter(facets, before, 1).gaps is None
    cutter.begin_step()
    first = cutter(facets, fluid.moving.motions[0], 1).gaps
    assert first.height.min() < 2.5
    assert cutter(facets, before, 1).gaps is first


def test_momentum_and_power():
    """What bodies get is what the whole fluid loses. Most of the power is that of the parabola in the film."""
    fluid = moving(-0.4)
    for number in range(34):
        step(fluid, 0.02 * number, 0.02)
    assert fluid.cut.gaps.height.min() < 0.3
    force, power, _ = fluid.balances()
    assert force == pytest.approx(fluid.force()["disc"].sum(axis=0), rel=1e-9, abs=1e-9)
    assert 0.0 < power < 0.4 * force[1]


def test_tangent_of_a_gap():
    """Newton's method takes one step for Stokes' equations; the tangent is the derivative of the residual."""
    disc = body("disc", circle([0.5, 0.7], 0.25, 100), loop(100), velocity=[0, -1])
    for convection in (False, True):
        fluid = scene(plate("lower", 0.2, 0.43), disc, element="q1q1", convection=convection, narrow_gaps=True)
        assert fluid.cut.gaps is not None
        assert solve_steady(fluid).iterations == 1 or convection
        flow = fluid.flow.copy()
        change = np.where(fluid.iterate.held, 0.0, np.random.default_rng(1).standard_normal(fluid.unknowns.owned))
        matrix = fluid.system.tangent(fluid.iterate.held, picard=False)
        u, out = matrix.createVecs()
        u.array[:] = change
        matrix.mult(u, out)
        rows = []
        for sign in (1.0, -1.0):
            fluid.flow[:] = flow + sign * 1e-4 * change
            rows.append(fluid.system.residual())
        found = np.where(fluid.iterate.held, 0.0, (rows[0] - rows[1]) / 2e-4)
        np.testing.assert_allclose(found, np.where(fluid.iterate.held, 0.0, out.array), atol=1e-7 * np.abs(found).max())


@pytest.mark.parametrize("height", [0.40, 0.36, 0.27])
def test_derivatives_by_the_motion_of_a_body(height):
    """Exact to 0.3 % in gaps of 0.9 to 0.3 cells; without the term continuity rows are wrong by up to 1.8 %."""
    patches = [Patch("walls", ("y-", "y+"), "no_slip"), Patch("ends", ("x-", "x+"), "traction", field(3.0, 0.0))]
    near = Moving(2, patches, mu=0.5, body_force=field(1.0, -2.0), centre=(0.47, height), narrow_gaps=True)
    assert near.fluid.cut.gaps.height.min() < 1.0
    for found, exact in near.derivatives():
        assert np.linalg.norm(found - exact) < 3e-3 * np.linalg.norm(exact)


def test_the_flow_in_a_gap_has_inertia():
    """A cylinder that starts at half a cell, with steps of a tenth of rho g^2 / mu: drags against that on finer cells.

    Of first order 22 % too large; it would be 3.1 times as large without the past of the flow in the gap.
    """
    points, facets = circle([0.0, 1.0], 1.0, 2000), loop(2000)

    def motion(x, t):
        gap = np.array([0.0, 0.5 * H * np.exp(-t)])
        return x + gap, 0.0 * x - gap

    patches = [
        Patch("symmetry", ("x-",), "slip"),
        Patch("free", ("x+", "y+"), "traction", field(0, 0)),
        Patch("wall", ("y-",), "no_slip"),
    ]
    forces = []
    for element, h, growth in (("q2q1", 0.5 * H, 1.05), ("q2q1", H, 1.15), ("q1q1", H, 1.15)):
        grid = Grid((stretched(h, 1.0, 8.0, growth), stretched(h, 4 * H, 8.0, growth)))
        fluid = make_fluid(
            grid, patches, [body("disc", points, facets, motion=motion)], dt=0.005, element=element, rho=18.0,
            scheme="bdf2", convection=False, narrow_gaps=True,
        )  # fmt: skip
        for number in range(16):
            step(fluid, 0.005 * number, 0.005)
        forces.append(fluid.force()["disc"].sum(axis=0)[1])
    assert forces[1] == pytest.approx(forces[0], rel=0.03)
    assert 1.0 < forces[2] / forces[0] < 1.25
