"""Viscosity that depends on the shear rate: profiles of channels, limits, the tangent, all schemes."""

import numpy as np
import pytest
from fluid_setup import around_moving_body, block, body, field, make_fluid, moving_body, step, with_slip

from solvers.fluid.flow.probes import of_fluid
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.settings.shear_law import ShearLaw
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.boundary.windkessel import Windkessel
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

PUSH, MU = 2.0, 0.3  #: force per volume along the channel, viscosity at the rate 1/s


def power_law(n, least=1e-4):
    """(viscosity at rest, law) of mu = MU rate^(n - 1)."""
    return MU * least ** (n - 1.0), ShearLaw(0.0, 1.0 / least, n)


def profile(y, n):
    """Exact velocity of a periodic channel of height 1 for a power law."""
    m = 1.0 / n + 1.0
    return (PUSH / MU) ** (1.0 / n) / m * (0.5**m - np.abs(y - 0.5) ** m)


def periodic(cells, element, n, *, dim=2, scheme="steady", **more):
    sides = Patch("walls", ("y-", "y+"), "no_slip")
    ends = [Patch("ends", ("x-", "x+"), "periodic"), Patch("sides", ("z-", "z+"), "slip")][: dim - 1]
    mu, law = power_law(n)
    shape = [4, cells, 2][:dim]
    return make_fluid(
        uniform([0] * dim, [1, 1, 1][:dim], shape), [*ends, sides], mu=mu, shear=law, element=element, scheme=scheme,
        body_force=field(*[PUSH, 0.0, 0.0][:dim]), **more,
    )  # fmt: skip


def error(fluid, n):
    """Largest error of the velocity at nodes, relative to the largest velocity."""
    nodes = fluid.unknowns.velocity
    exact = profile(nodes.points[:, 1], n)
    return np.abs(fluid.flow[nodes.dofs[:, 0]] - exact).max() / exact.max()


@pytest.mark.parametrize("n", [0.6, 1.5])
@pytest.mark.parametrize(("element", "order"), [("q1q1", 2.0), ("q2q1", 3.0)])
def test_a_power_law_in_a_channel(element, order, n):
    """Below 0.1 % with 32 cells. In its middle the profile |y|^(1 / n + 1) has no more derivatives than this power."""
    errors = []
    for cells in (16, 32):
        fluid = periodic(cells, element, n)
        step(fluid, 0.0, 1.0)
        errors.append(error(fluid, n))
    assert errors[1] < 1e-3
    assert np.log2(errors[0] / errors[1]) > min(order, 1.0 / n + 1.0) - 0.1


def test_the_least_rate_does_not_matter():
    """Over three decades."""
    found = []
    for least in (1e-2, 1e-5):
        mu, law = power_law(0.6, least)
        patches = [Patch("ends", ("x-", "x+"), "periodic"), Patch("walls", ("y-", "y+"), "no_slip")]
        fluid = make_fluid(
            uniform([0, 0], [1, 1], [4, 8]), patches, mu=mu, shear=law, scheme="steady", body_force=field(PUSH, 0.0)
        )
        step(fluid, 0.0, 1.0)
        found.append(fluid.velocity())
    assert np.abs(found[0] - found[1]).max() < 1e-4 * np.abs(found[1]).max()


@pytest.mark.parametrize("scheme", ["backward_euler", "bdf2", "bdf2_optimized"])
def test_in_time_to_the_same_flow(scheme):
    fluid = periodic(8, "q1q1", 0.6, dim=3, scheme=scheme, dt=1.0)
    for number in range(15):
        step(fluid, 1.0 * number, 1.0)
    steady = periodic(8, "q1q1", 0.6, dim=3)
    step(steady, 0.0, 1.0)
    assert np.abs(fluid.velocity() - steady.velocity()).max() < 1e-4 * np.abs(steady.velocity()).max()


def mixed(element="q1q1", law=None, scheme="bdf2", mu=0.05, grid=None):
    """Walls with and without slip, an inflow and an outlet, in which shear rates are about 5."""
    patches = [
        Patch("in", ("x-",), "velocity", field(lambda x, y, t: 4.0 * y * (1.0 - y), 0.0)),
        Patch("low", ("y-",), "no_slip"),
        Patch("high", ("y+",), "slip_length", (0.2,)),
        Patch("out", ("x+",), "resistance", outlet=Windkessel(2.0)),
    ]
    grid = grid or uniform([0, 0], [2, 1], [8, 6])
    return make_fluid(grid, patches, mu=mu, shear=law, element=element, scheme=scheme, dt=0.1)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize(
    "law", [ShearLaw(0.01, 2.0, 1.0), ShearLaw(0.01, 0.0, 0.4), ShearLaw(0.01, 1e-8, 0.4), ShearLaw(0.05, 3.0, 0.4)]
)
def test_limits_are_newtonian(element, law):
    """Exponent 1, time 0, low rates, and equal viscosities."""
    known, fluid = mixed(element), mixed(element, law)
    for some in (known, fluid):
        step(some, 0.0, 0.1)
    assert np.abs(fluid.flow - known.flow).max() < 1e-12 * np.abs(known.flow).max()


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("scheme", ["steady", "bdf2"])
@pytest.mark.parametrize("nested", [False, True])
def test_the_tangent_is_the_derivative(element, scheme, nested):
    coarse = uniform([0, 0], [2, 1], [6, 5])
    grid = refined(coarse, [RefinedBox([1, 0], [2, 0.5], 1)]) if nested else coarse
    fluid = mixed(element, ShearLaw(0.01, 2.0, 0.4), scheme, grid=grid)
    fluid.begin_step(0.0, 0.1)
    rng, system = np.random.default_rng(3), fluid.system
    fluid.flow[:] = rng.normal(size=len(fluid.flow))
    if nested:
        fluid.unknowns.share(system.flow)
    system.set_scales(fluid.velocity())
    state, nothing = fluid.flow.copy(), fluid.unknowns.hanging.dofs if nested else np.zeros(fluid.size, dtype=bool)
    direction = np.where(nothing, 0.0, rng.normal(size=len(state)))
    tangent = system.tangent(nothing, picard=False)
    x, y = tangent.createVecs()
    x.array[:] = direction
    tangent.mult(x, y)
    slope = y.array + system.outlets.product(nothing)(direction)
    found = []
    for sign in (1, -1):
        fluid.flow[:] = state + sign * 1e-5 * direction
        if nested:
            fluid.unknowns.share(system.flow)
        found.append(np.where(nothing, 0.0, system.residual()))
    difference = (found[0] - found[1]) / 2e-5
    assert np.abs(slope - difference).max() < 1e-6 * np.abs(difference).max()


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_power_of_the_force_is_dissipated(element):
    fluid = periodic(16, element, 0.6)
    step(fluid, 0.0, 1.0)
    n = 0.6
    m = 1.0 / n + 1.0
    rate = (PUSH / MU) ** (1.0 / n) / m * 0.5**m * (1.0 - 1.0 / (m + 1.0))
    assert of_fluid(fluid, "dissipation")()[""] == pytest.approx(PUSH * rate, rel=1e-2)


def test_units_do_not_matter():
    """In millimetres and milliseconds; pressures are the same."""
    one = mixed("q1q1", ShearLaw(0.01, 2.0, 0.4), "steady")
    patches = [
        Patch("in", ("x-",), "velocity", field(lambda x, y, t: 4.0 * y * (1000.0 - y) / 1e6, 0.0)),
        Patch("low", ("y-",), "no_slip"),
        Patch("high", ("y+",), "slip_length", (200.0,)),
        Patch("out", ("x+",), "resistance", outlet=Windkessel(2e-3)),
    ]
    other = make_fluid(
        uniform([0, 0], [2000, 1000], [8, 6]), patches, mu=50.0, shear=ShearLaw(10.0, 2000.0, 0.4), scheme="steady"
    )
    for some in (one, other):
        step(some, 0.0, 1.0)
    assert np.abs(one.velocity() - other.velocity()).max() < 1e-8
    nodes = one.unknowns.pressure.dofs[:, 0]
    assert other.flow[nodes] == pytest.approx(one.flow[nodes], rel=1e-7)


def test_newton_is_quadratic():
    fluid = mixed("q2q1", ShearLaw(0.001, 2.0, 0.4), "bdf2")
    step(fluid, 0.0, 0.1)
    fluid.begin_step(0.1, 0.1)
    assert fluid.solve().iterations <= 5


# ----------------------------------------------------------------------------------------------------- with bodies

LOW = 0.0131  #: height of the lower wall, which cuts cells


def between_bodies(cells, element, n, inflow, *, speed=0.0, push=0.0, scheme="steady", least=1e-4):
    """A channel of height 1 between two bodies; the lower one slides along itself by `speed`."""
    mu, law = power_law(n, least)
    along = field(lambda x, y, t: inflow(y - LOW), 0.0)
    patches = [
        Patch("in", ("x-",), "velocity", along),
        Patch("out", ("x+",), "outflow"),
        Patch("covered", ("y-", "y+"), "no_slip"),
    ]
    low = body("low", *block([-5, -3], [6, LOW]), velocity=np.array([speed, 0.0]))
    high = body("high", *block([-5, 1.0 + LOW], [6, 4]))
    return make_fluid(
        uniform([0, -0.2], [1, 1.2], [4, cells]), patches, [low, high], mu=mu, shear=law, element=element,
        scheme=scheme, body_force=field(push, 0.0), initial_velocity=along, dt=0.1,
        solver=SolverSettings(Tolerance(residual=1e-8), linear="direct"),
    )  # fmt: skip


def on_bodies(fluid):
    return {name: force.sum(axis=0)[0] for name, force in fluid.force().items()}


@pytest.mark.parametrize("n", [0.6, 1.5])
def test_a_channel_between_bodies(n):
    """Velocity and drag below 0.1 % with 40 cells across, and falling."""
    errors, drags = [], []
    for cells in (28, 56):
        fluid = between_bodies(cells, "q2q1", n, lambda y: profile(y, n), push=PUSH)
        step(fluid, 0.0, 1.0)
        nodes = fluid.unknowns.velocity
        y = nodes.points[:, 1] - LOW
        inside, exact = (y > 0.0) & (y < 1.0), profile(y, n)
        errors.append(np.abs(fluid.flow[nodes.dofs[:, 0]] - exact)[inside].max() / exact[inside].max())
        drags.append(abs(sum(on_bodies(fluid).values()) / PUSH - 1.0))
    assert errors[1] < 1e-3
    assert errors[1] < 0.5 * errors[0]
    assert drags[1] < 1.2e-3
    assert drags[1] < 0.5 * drags[0]


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_a_wall_that_slides(element):
    """A linear profile is exact at any cut, with the drag mu(rate) rate on both sides, and forces balance."""
    n, speed, least = 0.6, 2.0, 1e-2
    fluid = between_bodies(14, element, n, lambda y: speed * (1.0 - y), speed=speed, scheme="bdf2", least=least)
    for number in range(2):
        step(fluid, 0.1 * number, 0.1)
    nodes = fluid.unknowns.velocity
    y = nodes.points[:, 1] - LOW
    inside = (y > 0.0) & (y < 1.0)
    assert fluid.flow[nodes.dofs[:, 0]][inside] == pytest.approx(speed * (1.0 - y[inside]), abs=5e-5)
    drag, forces = MU * (speed**2 + least**2) ** (0.5 * (n - 1.0)) * speed, on_bodies(fluid)
    assert forces["low"] == pytest.approx(-drag, rel=5e-5)
    assert forces["high"] == pytest.approx(drag, rel=5e-5)
    balance, lost, _ = fluid.balances()
    assert balance == pytest.approx([0.0, 0.0], abs=1e-4 * drag)
    assert abs(lost) < 1e-4 * drag * speed


def test_the_first_force_is_no_measure_of_others():
    """A wall starts to slide in fluid at rest, whose viscosity is 1e4 times that of the flow: the tolerance holds."""
    mu, law = power_law(0.5, 1e-8)
    walls = Patch("walls", ("x-", "x+", "y-", "y+"), "no_slip")
    low = body("low", *block([-5, -3], [6, LOW]), velocity=np.array([2.0, 0.0]))
    high = body("high", *block([-5, 1.0 + LOW], [6, 4]))
    found = []
    for tolerance in (1e-8, 1e-14):
        fluid = make_fluid(
            uniform([0, -0.2], [1, 1.2], [8, 14]), [walls], [low, high], mu=mu, shear=law, scheme="steady",
            solver=SolverSettings(Tolerance(tolerance, max_iterations=60), linear="direct"),
        )  # fmt: skip
        step(fluid, 0.0, 1.0)
        found.append(on_bodies(fluid))
    assert found[0] == pytest.approx(found[1], rel=1e-5)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("law", [ShearLaw(0.001, 2.0, 1.0), ShearLaw(0.03, 2.0, 0.4)])
def test_limits_are_newtonian_around_a_moving_body(element, law):
    def flow(law):
        patches = [
            Patch("in", ("x-",), "velocity", field(lambda x, y, t: 1.0 + y, 0.1)),
            Patch("sides", ("y-", "y+"), "slip"),
            Patch("out", ("x+",), "outflow"),
        ]
        moved = with_slip(moving_body(2), 0.05)
        fluid = make_fluid(around_moving_body(2), patches, [moved], mu=0.03, shear=law, element=element, dt=0.05)
        for number in range(2):
            step(fluid, 0.05 * number, 0.05)
        return fluid

    known, fluid = flow(None), flow(law)
    assert np.abs(fluid.flow - known.flow).max() < 1e-10 * np.abs(known.flow).max()
    for name, force in known.force().items():
        assert np.abs(fluid.force()[name] - force).max() < 1e-10 * np.abs(force).max()


def test_resumed_around_a_moving_body():
    """Bit for bit, the force before the next step included."""

    def flow():
        patches = [Patch("in", ("x-",), "velocity", field(1.0, 0.1)), Patch("sides", ("y-", "y+", "x+"), "outflow")]
        law = ShearLaw(0.003, 2.0, 0.4)
        return make_fluid(around_moving_body(2), patches, [moving_body(2)], mu=0.03, shear=law, dt=0.05)

    whole, resumed = flow(), flow()
    for number in range(2):
        step(whole, 0.05 * number, 0.05)
    resumed.restore(whole.save())
    for number in (2, 3):
        for some in (whole, resumed):
            step(some, 0.05 * number, 0.05)
        assert np.array_equal(whole.flow, resumed.flow)
