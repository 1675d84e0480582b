"""Outlets with a resistance or a Windkessel: a line of the flow rate in each step, exact in Newton's method."""

from itertools import pairwise

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, sphere, step

from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.boundary.windkessel import Outlets, Windkessel
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

ELEMENTS = ["q1q1", "q2q1"]
SCHEMES = ["backward_euler", "bdf2", "bdf2_optimized"]
LAW = Windkessel(proximal=0.7, distal=2.5, capacitance=0.16, pressure=0.4)  # R_d C = 0.4 s


def charged(t, q):
    """P at times t of the Windkessel for a constant flow rate q."""
    decay = np.exp(-t / (LAW.distal * LAW.capacitance))
    return LAW.proximal * q + LAW.distal * q * (1.0 - decay) + LAW.pressure * decay


def duct(dim, element, law, *, inflow=None, scheme="bdf2", bodies=(), grid=None, mu=0.3, dt=0.1, **more):
    """A straight duct with slip walls; inflow: velocity at x- by time, else the pressure 3 there."""
    sides = ("y-", "y+", "z-", "z+")[: 2 * dim - 2]
    given = Patch("in", ("x-",), "pressure", (3.0,))
    if inflow is not None:
        given = Patch("in", ("x-",), "velocity", field(*[lambda *xt: inflow(xt[-1]), 0.0, 0.0][:dim]))
    patches = [given, Patch("walls", sides, "slip"), Patch("out", ("x+",), "windkessel", outlet=law)]
    grid = grid or uniform([0] * dim, [2, 1, 1][:dim], [5, 4, 3][:dim])
    return make_fluid(grid, patches, bodies, mu=mu, dt=dt, element=element, scheme=scheme, **more)


def rate(fluid):
    """q of the outlet."""
    return float(fluid.system.outlets.rates(fluid.flow[: fluid.size])[0])


def pressure(fluid):
    """P of the outlet."""
    return float(fluid.system.outlets.pressures(fluid.flow[: fluid.size])[0])


# ------------------------------------------------------------------------------------------------------ one outlet


@pytest.mark.parametrize("steps", [1, 7, 1000])
def test_a_constant_flow_is_exact_whatever_the_steps(steps):
    """An impulsive start is."""
    outlets, dt = Outlets({"out": LAW}), 0.9 / steps
    for _ in range(steps):
        outlets.begin_step(dt)
        outlets.end_step([1.3])
    line = outlets.lines[0]
    assert line.resistance * 1.3 + line.pressure == pytest.approx(charged(0.9, 1.3), rel=1e-12)


@pytest.mark.parametrize("proximal", [0.0, 0.7])
def test_a_linear_flow_is_exact_after_the_first_step(proximal):
    """q = t: P_c = R_d (t - T (1 - e^(-t / T)))."""
    law, T = Windkessel(proximal, 2.5, 0.16), 0.4
    outlets = Outlets({"out": law})
    outlets.restore({"names": ["out"], "pressures": [0.0], "rates": [0.0]})
    times = [0.0, 0.3, 0.35, 1.1]
    for before, t in pairwise(times):
        outlets.begin_step(t - before)
        outlets.end_step([t])
    line = outlets.lines[0]
    exact = proximal * 1.1 + 2.5 * (1.1 - T * (1.0 - np.exp(-1.1 / T)))
    assert line.resistance * 1.1 + line.pressure == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("scale", [1e-9, 1e-5, 0.9e-3, 1.1e-3])
def test_hardly_any_leak_is_a_pure_capacitance(scale):
    """The volume stored, C P_c, is that which came: the trapezoidal rule, on both sides of the series."""
    law = Windkessel(0.0, 1.0 / (scale * 0.16), 0.16)
    outlets = Outlets({"out": law})
    outlets.restore({"names": ["out"], "pressures": [0.0], "rates": [1.0]})
    outlets.begin_step(1.0)
    outlets.end_step([3.0])
    line, x = outlets.lines[0], scale
    exact = 2.0 - x * (1.0 / 2.0 + 2.0 / 6.0) + x**2 * (1.0 / 6.0 + 2.0 / 24.0)
    assert 0.16 * (3.0 * line.resistance + line.pressure) == pytest.approx(exact, rel=1e-9)


def test_neither_resistance_nor_capacitance_is_an_outflow():
    outlets = Outlets({"out": Windkessel()})
    outlets.begin_step(0.1)
    assert (outlets.lines[0].resistance, outlets.lines[0].pressure) == (0.0, 0.0)


# ------------------------------------------------------------------------------------------------------ in the flow


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("dim", [2, 3])
def test_plug_flow_into_a_windkessel(dim, element, scheme):
    """A uniform flow that starts at once: after the start the pressure everywhere is that of the outlet."""
    fluid, q = duct(dim, element, LAW, inflow=lambda t: 1.3, scheme=scheme), 1.3
    for number in range(5):
        step(fluid, 0.1 * number, 0.1)
        assert rate(fluid) == pytest.approx(q, rel=1e-10)
        assert pressure(fluid) == pytest.approx(charged(0.1 * (number + 1), q), rel=1e-9)
    at_nodes = fluid.flow[fluid.unknowns.pressure.dofs[:, 0]]
    assert at_nodes == pytest.approx(pressure(fluid), rel=1e-9)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_pulse_is_second_order(scheme):
    """q = sin^2 t: the error of the pressure is below 0.1 % at 60 steps per period, a quarter with half of the step."""
    T, w = LAW.distal * LAW.capacitance, 2.0
    law = Windkessel(LAW.proximal, LAW.distal, LAW.capacitance)

    def exact(t):
        decay, size = np.exp(-t / T), 1.0 + (w * T) ** 2
        wave = (np.cos(w * t) + w * T * np.sin(w * t) - decay) / size
        return law.proximal * np.sin(t) ** 2 + 0.5 * law.distal * (1.0 - decay - wave)

    errors = []
    for steps in (60, 120):
        fluid, dt = duct(2, "q1q1", law, inflow=lambda t: np.sin(t) ** 2, scheme=scheme), np.pi / steps
        found = []
        for number in range(steps):
            step(fluid, dt * number, dt)
            found.append(pressure(fluid))
        times = dt * np.arange(1, steps + 1)
        errors.append(np.abs(np.array(found) - exact(times)).max() / exact(times).max())
    assert errors[0] < 1e-3
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.parametrize("scheme", ["steady", *SCHEMES])
@pytest.mark.parametrize("element", ELEMENTS)
def test_poiseuille_against_a_resistance(element, scheme):
    """3 - R q = 12 mu L q / H^3 with the given profile of a channel, exact for second degree."""
    R, mu = 2.0, 0.3
    profile = lambda x, y, t: 6.0 * y * (1.0 - y)  # noqa: E731
    patches = [
        Patch("in", ("x-",), "velocity", field(profile, 0.0)),
        Patch("walls", ("y-", "y+"), "no_slip"),
        Patch("out", ("x+",), "resistance", outlet=Windkessel(R)),
    ]
    start = field(profile, 0.0)
    fluid = make_fluid(
        uniform([0, 0], [2, 1], [6, 12]), patches, mu=mu, element=element, scheme=scheme, dt=0.1, initial_velocity=start
    )
    for number in range(2):
        step(fluid, 0.1 * number, 0.1)
    if element == "q2q1":
        assert rate(fluid) == pytest.approx(1.0, rel=1e-10)
        x = fluid.unknowns.pressure.points[:, 0]
        found = fluid.flow[fluid.unknowns.pressure.dofs[:, 0]]
        assert found == pytest.approx(R + 12.0 * mu * (2.0 - x), rel=1e-8)
    else:
        assert rate(fluid) == pytest.approx(1.0, rel=1e-2)
    assert pressure(fluid) == pytest.approx(R * rate(fluid), rel=1e-12)


@pytest.mark.parametrize("R", [1e-3, 1.0, 1e3, 1e6])
def test_a_channel_and_an_outlet_in_series(R):
    """Steady flow from a pressure: q (12 mu L / H^3 + R_p + R_d) = 3, whatever the ratio of the two."""
    patches = [
        Patch("in", ("x-",), "pressure", (3.0,)),
        Patch("walls", ("y-", "y+"), "no_slip"),
        Patch("out", ("x+",), "windkessel", outlet=Windkessel(0.4 * R, 0.6 * R, 123.0, 7.0)),
    ]
    fluid = make_fluid(uniform([0, 0], [2, 1], [5, 4]), patches, mu=0.3, element="q2q1", scheme="steady")
    step(fluid, 0.0, 1.0)
    assert rate(fluid) == pytest.approx(3.0 / (R + 12.0 * 0.3 * 2.0), rel=1e-8)


@pytest.mark.parametrize("dim", [2, 3])
def test_flow_divides_as_resistances_ask(dim):
    """Two outlets beside one another, apart from friction: conductances add up."""
    sides = ("y-", "y+", "z-", "z+")[: 2 * dim - 2]
    patches = [
        Patch("in", ("x-",), "velocity", field(*[2.0, 0.0, 0.0][:dim])),
        Patch("walls", sides, "slip"),
        Patch("low", ("x+",), "resistance", where=lambda x, t: 0.5 - x[1], outlet=Windkessel(1e4)),
        Patch("high", ("x+",), "resistance", where=lambda x, t: x[1] - 0.5, outlet=Windkessel(3e4)),
    ]
    fluid = make_fluid(uniform([0] * dim, [2, 1, 1][:dim], [6, 4, 3][:dim]), patches, mu=0.1, dt=0.2)
    step(fluid, 0.0, 0.2)
    rates = fluid.system.outlets.rates(fluid.flow[: fluid.size])
    assert rates == pytest.approx([1.5, 0.5], rel=2e-3)
    assert rates.sum() == pytest.approx(2.0, rel=1e-10)


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("dim", [2, 3])
def test_around_a_body_in_the_outlet(dim, element):
    """The tangent with the outlet is the derivative; q is the flow rate of the probe, through the wet part alone."""
    obstacle = block([1.53, 0.23, 0.31][:dim], [2.4, 0.55, 0.77][:dim])
    ball = (circle((0.4, 0.45), 0.17, 30), loop(30)) if dim == 2 else sphere((0.4, 0.45, 0.5), 0.2, 1)
    v = np.array([0.7, 0.2, -0.1])[:dim]
    bodies = [body("obstacle", *obstacle), body("ball", *ball, motion=lambda x, t: (x + t * v, 0 * x + v))]
    law = Windkessel(5e3, 3.0, 0.1)
    fluid = duct(dim, element, law, inflow=lambda t: 0.5, bodies=bodies)
    step(fluid, 0.0, 0.1)
    assert rate(fluid) == pytest.approx(flow_rate(fluid)(["out"]), rel=1e-12)
    fluid.begin_step(0.1, 0.1)
    rng, system, state = np.random.default_rng(3), fluid.system, fluid.flow.copy()
    nothing = np.zeros(fluid.size, dtype=bool)
    direction = rng.normal(size=len(state)) * system.active_dofs
    system.set_scales(fluid.velocity())
    tangent = system.tangent(nothing, picard=False)
    x, y = tangent.createVecs()
    x.array[:] = direction
    tangent.mult(x, y)
    added = system.outlets.product(nothing)(direction)
    found = []
    for sign in (1, -1):
        fluid.flow[:] = state + sign * 1e-5 * direction
        found.append(system.residual())
    difference = (found[0] - found[1]) / 2e-5
    assert np.abs(y.array + added - difference).max() < 1e-6 * np.abs(difference).max()
    assert np.abs(added).max() > 1e3 * 1e-6 * np.abs(difference).max()


def test_unequal_cells_at_the_outlet():
    grid = refined(uniform([0, 0], [2, 1], [6, 5]), [RefinedBox([1, 0], [2, 0.5], 1)])
    for element in ELEMENTS:
        fluid = duct(2, element, LAW, inflow=lambda t: 1.3, grid=grid)
        for number in range(3):
            step(fluid, 0.1 * number, 0.1)
        assert pressure(fluid) == pytest.approx(charged(0.3, 1.3), rel=1e-9)
        at_nodes = fluid.flow[fluid.unknowns.pressure.dofs[:, 0]]
        assert at_nodes == pytest.approx(pressure(fluid), rel=1e-8)


@pytest.mark.parametrize(("dim", "element", "linear"), [
    (2, "q1q1", "ilu"), (2, "q2q1", "iterative"), (3, "q1q1", "iterative"),
    pytest.param(3, "q1q1", "ilu", marks=pytest.mark.slow),
])  # fmt: skip
def test_iterative_solvers_take_few_more_iterations(dim, element, linear):
    """One with a good preconditioner, a few with incomplete factors, whatever the resistance."""
    solver = SolverSettings(Tolerance(residual=1e-10), linear=linear, linear_tolerance=1e-10)
    grid, counts, rates = uniform([0] * dim, [2, 1, 1][:dim], [16, 9, 8][:dim]), [], []
    for law in (Windkessel(), Windkessel(1.0), Windkessel(1e4), Windkessel(1e7)):
        fluid = duct(dim, element, law, inflow=lambda t: 0.5, grid=grid, solver=solver, mu=0.02)
        steps = [step(fluid, 0.1 * number, 0.1) for number in range(3)]  # the count of one step depends on rounding
        counts.append(sum(one.numbers["fluid.linear"] for one in steps) / sum(one.iterations for one in steps))
        rates.append(rate(fluid))
    assert rates == pytest.approx([0.5] * 4, rel=1e-8)
    assert max(counts[1:]) <= (counts[0] + 3.0 if linear == "iterative" else 2.2 * counts[0])


def test_newton_needs_no_more_iterates():
    counts = []
    for law in (Windkessel(), Windkessel(1e3, 1e4, 1e-4)):
        fluid = duct(2, "q1q1", law, inflow=lambda t: 0.5, mu=0.02)
        counts.append([step(fluid, 0.1 * n, 0.1).iterations for n in range(3)])
    assert counts[0] == counts[1]


@pytest.mark.parametrize("element", ELEMENTS)
def test_resumed_steps_are_the_same(element):
    whole = duct(2, element, LAW)
    states = []
    for number in range(4):
        step(whole, 0.1 * number, 0.1)
        states.append(whole.save())
    resumed = duct(2, element, LAW)
    resumed.restore(states[1])
    for number in (2, 3):
        step(resumed, 0.1 * number, 0.1)
    assert np.array_equal(resumed.flow, whole.flow)
    assert resumed.save()["outlets"] == whole.save()["outlets"]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_swing_between_inertia_and_capacitance_dies_down(scheme):
    """Fluid of mass per area squared L = 2 on a capacitance C = 1/2: q^2 L / 2 + P^2 C / 2 does not grow."""
    law = Windkessel(0.0, 1e9, 0.5, 3.0)
    fluid = duct(2, "q1q1", law, scheme=scheme, convection=False, dt=0.05, initial_velocity=field(1.0, 0.0))
    energies = []
    for number in range(150):
        step(fluid, 0.05 * number, 0.05)
        energies.append(rate(fluid) ** 2 + 0.25 * (pressure(fluid) - 3.0) ** 2)
    assert max(energies) < 1.0 + 1e-9
    if scheme == "bdf2_optimized":
        assert min(energies) > 0.98
