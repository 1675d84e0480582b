"""Periodic flows with a given rate: the force that drives it is that of exact flows, the flow is that of the force."""

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, nodal_errors, sphere, step

from solvers.api import StepFailed
from solvers.fluid.cut.ways import winds
from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.settings.shear_law import ShearLaw
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.boundary.windkessel import Windkessel
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

GRADED = Grid((np.array([0, 0.5, 0.8, 1.5, 2.2, 3.0]), np.array([0, 0.2, 0.6, 0.8, 1.0])))
WALLS = Patch("walls", ("y-", "y+"), "no_slip")


def still(x, t):
    return 0.0 * x[0]


def ends(rate, axis="x"):
    value = (lambda x, t: rate(t) + 0.0 * x[0]) if callable(rate) else rate
    return Patch("ends", (f"{axis}-", f"{axis}+"), "periodic", rate=value)


def driving(fluid):
    """G along the first period."""
    return next(iter(fluid.on_cells.driving_forces.values()))


@pytest.mark.parametrize("scheme", ["steady", "backward_euler", "bdf2", "bdf2_optimized"])
@pytest.mark.parametrize("convection", [False, True])
def test_poiseuille(scheme, convection):
    """G = 12 mu Q / H^3."""
    Q, mu = 0.7, 0.1
    profile = lambda x, t: 6.0 * Q * x[1] * (1.0 - x[1])  # noqa: E731
    fluid = make_fluid(
        GRADED, [ends(Q), WALLS], element="q2q1", mu=mu, scheme=scheme, convection=convection,
        initial_velocity=None if scheme == "steady" else (profile, still), dt=0.1,
    )  # fmt: skip
    for number in range(1 if scheme == "steady" else 4):
        step(fluid, 0.1 * number, 0.1)
    u, p = nodal_errors(fluid, (profile, still), still, 0.0, level=True)
    assert u < 1e-12
    assert p < 1e-11
    assert driving(fluid) == pytest.approx(12.0 * mu * Q, rel=1e-11)
    assert flow_rate(fluid)(["ends"]) == pytest.approx(Q, rel=1e-12)


def channel(periods, bodies=(), *, dim=2, n=1, **more):
    """A channel or square duct around bodies."""
    grid = uniform([0] * dim, [2, 1, 1][:dim], [n * cells for cells in (16, 8, 8)[:dim]] if dim == 2 else [8, 5, 5])
    walls = Patch("walls", ("y-", "y+", "z-", "z+")[: 2 * dim - 2], "no_slip")
    more = {"mu": 0.05, "dt": 0.1, "element": "q1q1"} | more
    return make_fluid(grid, [*periods, walls], bodies, **more)


def disc(dim=2, *, v=(0.0, 0.0, 0.0), x=0.61):
    points, facets = (circle((x, 0.47), 0.2, 24), loop(24)) if dim == 2 else sphere((x, 0.47, 0.53), 0.2, 1)
    if not any(v):
        return body("disc", points, facets)
    way = np.array(v[:dim])
    return body("disc", points, facets, motion=lambda x, t: (x + t * way, 0 * x + way))


def pulse(t):
    return 0.2 + 0.3 * np.sin(7.0 * t)


def run(fluid, steps=4, dt=0.1):
    """(the force of each step, its Newton iterations, its linear iterations, the flow)."""
    rows = []
    for number in range(steps):
        info = step(fluid, dt * number, dt)
        rows.append((driving(fluid), info.iterations, info.numbers["fluid.linear"]))
    return *np.array(rows).T, fluid.flow.copy()


def twin_force(forces, dt=0.1):
    """A body force along x that has the given value at the end of each step."""
    return field(lambda *xt: forces[max(round(xt[-1] / dt) - 1, 0)], 0.0)


@pytest.mark.parametrize("moves", ["no body", "rests", "moves", "crosses"])
@pytest.mark.parametrize(("element", "scheme"), [("q1q1", "bdf2"), ("q2q1", "bdf2_optimized"), ("q1q1", "steady")])
def test_the_flow_is_that_of_its_force(element, scheme, moves):
    """Run with a rate, read G, run with the body force G, in as many iterations."""
    place = {"rests": {}, "moves": {"v": (0.3, 0.2, 0.0)}, "crosses": {"v": (0.4, 0.1, 0.0), "x": 1.75}}
    bodies = [disc(**place[moves])] if moves in place else []
    # where steady flows scale their stabilisation depends on the way there, which Stokes' do not show
    more = {"element": element, "scheme": scheme, "convection": scheme != "steady"}
    forces, counts, _, flow = run(channel([ends(pulse)], bodies, **more))
    other = channel([ends(None)], bodies, body_force=twin_force(forces), **more)
    others = [step(other, 0.1 * n, 0.1).iterations for n in range(4)]
    assert np.abs(other.flow - flow).max() < 1e-12 * np.abs(flow).max()
    assert np.abs(counts - others).max() <= 1


def test_a_steady_flow_is_that_of_its_force():
    """Both from their own solution, so that the stabilisation of both is scaled by it."""
    fluid = channel([ends(0.5)], [disc()], scheme="steady", element="q2q1")
    forces = run(fluid)[0]
    other = channel([ends(None)], [disc()], scheme="steady", element="q2q1", body_force=field(forces[-1], 0.0))
    run_on = [step(other, 0.1 * n, 0.1).iterations for n in range(4)]
    assert len(run_on) == 4
    assert np.abs(other.flow - fluid.flow).max() < 1e-8 * np.abs(fluid.flow).max()


def thin(element):
    way = np.array([0.3, 0.05])
    plate = block([0.83, 0.2], [0.84, 0.6])
    return [body("plate", *plate, motion=lambda x, t: (x + t * way, 0 * x + way))], [WALLS], {"element": element}


def open_above(kind):
    outlet = Windkessel(3.0) if kind == "resistance" else None
    sides = [Patch("floor", ("y-",), "no_slip"), Patch("top", ("y+",), kind, outlet=outlet)]
    return [disc(v=(0.3, 0.2, 0.0))], sides, {"element": "q1q1"}


@pytest.mark.parametrize(("bodies", "sides", "more"), [
    thin("q1q1"), thin("q2q1"), open_above("outflow"), open_above("resistance"),
    ([disc()], [WALLS], {"shear": ShearLaw(0.001, 2.0, 0.4)}),
    ([disc(v=(0.1, -0.5, 0.0))], [WALLS], {"narrow_gaps": True}),
], ids=["thin q1q1", "thin q2q1", "outflow", "resistance", "shear", "gaps"])  # fmt: skip
def test_beside_other_features(bodies, sides, more):
    """Thin bodies with unknowns of each side, outlets, a viscosity by the shear rate, narrow gaps: as their force."""
    grid = uniform([0, 0], [2, 1], [16, 8])
    fluid = make_fluid(grid, [ends(pulse), *sides], bodies, mu=0.05, dt=0.1, **more)
    forces, counts, _, flow = run(fluid)
    force = twin_force(forces)
    other = make_fluid(grid, [ends(None), *sides], bodies, mu=0.05, dt=0.1, body_force=force, **more)
    others = [step(other, 0.1 * n, 0.1).iterations for n in range(4)]
    assert np.abs(other.flow - flow).max() < 1e-10 * np.abs(flow).max()
    assert counts.sum() <= sum(others) + 2


@pytest.mark.parametrize("scheme", ["steady", "bdf2"])
def test_plug_flow_along_slip_walls(scheme):
    """Nothing resists in steady flow; in time the jump of the rate is that of the momentum, and then no force acts."""
    walls = Patch("walls", ("y-", "y+"), "slip")
    fluid = make_fluid(uniform([0, 0], [2, 1], [4, 4]), [ends(0.2), walls], mu=0.1, dt=0.1, scheme=scheme)
    forces = run(fluid, 2)[0]
    assert forces == pytest.approx([0.0 if scheme == "steady" else 2.0, 0.0], abs=1e-12)
    assert fluid.flow[fluid.unknowns.velocity.dofs[:, 0]] == pytest.approx(0.2, rel=1e-12)


def test_a_period_that_is_too_narrow():
    fluid = make_fluid(uniform([0, 0], [2, 1], [4, 1]), [ends(0.2), WALLS], mu=0.1, dt=0.1)
    with pytest.raises(
        StepFailed, match="no node of the flow is free along a period with a 'rate': nothing flows there"
    ):
        step(fluid, 0.0, 0.1)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("linear", ["direct", "iterative", "ilu"])
def test_a_period_that_a_body_blocks(element, linear):
    wall = body("wall", *block([0.83, -0.1], [1.13, 1.1]))
    solver = SolverSettings(Tolerance(residual=1e-8), linear=linear)
    fluid = channel([ends(0.2)], [wall], element=element, solver=solver)
    with pytest.raises(StepFailed, match="bodies close a period, and leave no way for its 'rate'"):
        step(fluid, 0.0, 0.1)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_the_rate_is_the_mean_over_the_period(element):
    """At rest that of any section; where a body crosses the end, the mean volume flux of the fluid."""
    at_rest = channel([ends(pulse)], [disc()], element=element)
    run(at_rest, 2)
    assert float(at_rest.system.driving.rates(at_rest.iterate.values())[0]) == pytest.approx(pulse(0.2), rel=1e-12)
    through = flow_rate(at_rest)(["ends"])
    assert through == pytest.approx(pulse(0.2), rel=2e-2 if element == "q1q1" else 2e-3)


def test_womersley():
    """G = Re(i w rho Q0 e^(i w t) / (1 - tanh(k / 2) / (k / 2))) with k^2 = i w rho H^2 / mu, to second order."""
    w, mu, Q0 = 2.0 * np.pi, 0.05, 0.4
    k = np.sqrt(1j * w / mu)
    factor = 1j * w / (1.0 - np.tanh(k / 2) / (k / 2))
    force = lambda t: (factor * Q0 * np.exp(1j * w * t)).real  # noqa: E731

    def profile(x, t):
        return (factor * Q0 / (1j * w) * (1.0 - np.cosh(k * (x[1] - 0.5)) / np.cosh(k / 2)) * np.exp(1j * w * t)).real

    grid, errors = Grid((np.array([0.0, 0.7, 1.0]), 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, 25)))), []
    for steps in (40, 80):
        dt = 1.0 / steps
        fluid = make_fluid(
            grid, [ends(lambda t: Q0 * np.cos(w * t)), WALLS], element="q2q1", mu=mu, dt=dt,
            initial_velocity=(profile, still),
        )  # fmt: skip
        found = []
        for number in range(2 * steps):
            step(fluid, dt * number, dt)
            found.append(driving(fluid))
        times = dt * np.arange(1, 2 * steps + 1)
        errors.append(np.abs(np.array(found) - force(times))[steps:].max() / abs(factor * Q0))
    assert errors[0] < 2e-2
    assert errors[1] < 0.28 * errors[0]


def test_a_square_duct():
    """G = 28.454 mu Q / H^4 of the series of White, Viscous Fluid Flow, 3-3.3."""
    n = np.arange(1, 40, 2)
    exact = 12.0 / (1.0 - 192.0 / np.pi**5 * np.sum(np.tanh(n * np.pi / 2) / n**5))
    errors = []
    for cells in (2, 4):
        walls = Patch("walls", ("y-", "y+", "z-", "z+"), "no_slip")
        fluid = make_fluid(
            uniform([0, 0, 0], [1, 1, 1], [2, cells, cells]),
            [ends(0.3), walls],
            element="q2q1",
            mu=0.2,
            scheme="steady",
        )
        step(fluid, 0.0, 1.0)
        errors.append(abs(driving(fluid) / (exact * 0.2 * 0.3) - 1.0))
    assert errors[1] < 5e-3
    assert errors[1] < 0.3 * errors[0]


def test_two_periods_at_once():
    """Between plates, each with the rate per area of the other one's section: the two do not know of one another."""
    grid = uniform([0, 0, 0], [2, 1, 3], [2, 2, 2])
    periods = [Patch("x", ("x-", "x+"), "periodic", rate=0.6), Patch("z", ("z-", "z+"), "periodic", rate=-0.8)]
    fluid = make_fluid(grid, [*periods, WALLS], element="q2q1", mu=0.1, scheme="steady")
    step(fluid, 0.0, 1.0)
    found = fluid.on_cells.driving_forces
    assert found == pytest.approx({"x": 1.2 * 0.6 / 3.0, "z": -1.2 * 0.8 / 2.0}, rel=1e-11)


def test_it_adds_to_a_body_force():
    """Which changes the force alone, not the flow."""
    forces, flows = [], []
    for more in (None, 3.0):
        given = None if more is None else field(more, 0.0)
        found = run(channel([ends(pulse)], [disc()], body_force=given))
        forces.append(found[0])
        flows.append(found[3])
    assert forces[1] == pytest.approx(forces[0] - 3.0, rel=1e-10)
    assert np.abs(flows[1] - flows[0]).max() < 1e-11


@pytest.mark.parametrize(("dim", "element", "linear"), [
    (2, "q1q1", "ilu"), (2, "q2q1", "iterative"), (3, "q1q1", "iterative"),
    pytest.param(3, "q1q1", "ilu", marks=pytest.mark.slow),
])  # fmt: skip
def test_iterative_solvers(dim, element, linear):
    """They take one more iteration or a few than for the force, and find the solution of the direct one."""
    solver = SolverSettings(Tolerance(residual=1e-10), linear=linear, linear_tolerance=1e-10)
    given = {"dim": dim, "element": element}
    forces, newton, counts, flow = run(channel([ends(pulse)], [disc(dim)], solver=solver, **given), 2)
    exact = run(channel([ends(pulse)], [disc(dim)], **given), 2)[3]
    force = (*twin_force(forces), *[still] * (dim - 2))
    other = channel([ends(None)], [disc(dim)], solver=solver, body_force=force, **given)
    steps = [step(other, 0.1 * n, 0.1) for n in range(2)]
    assert np.abs(flow - exact).max() < 1e-7 * np.abs(exact).max()
    per_system = sum(s.numbers["fluid.linear"] for s in steps) / sum(s.iterations for s in steps)
    assert counts.sum() / newton.sum() <= per_system + 3.0


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_scaled(size):
    """Lengths times s, times times s^2, the same fluid: rates stay per depth, forces are s^-3 times as large."""
    one = run(channel([ends(pulse)], [disc(v=(0.3, 0.2, 0.0))]))
    grid = uniform([0, 0], [2 * size, size], [16, 8])
    place, way = circle((0.61 * size, 0.47 * size), 0.2 * size, 24), np.array([0.3, 0.2]) / size
    moved = body("disc", place, loop(24), motion=lambda x, t: (x + t * way, 0 * x + way))
    other = make_fluid(grid, [ends(lambda t: pulse(t / size**2)), WALLS], [moved], mu=0.05, dt=0.1 * size**2)
    found = run(other, dt=0.1 * size**2)
    assert found[0] == pytest.approx(one[0] / size**3, rel=1e-9)
    assert found[1] == pytest.approx(one[1], abs=1)


def test_a_third_of_a_cell():
    """The force of a disc hardly depends on where it is in its cell."""
    found = [run(channel([ends(0.4)], [disc(x=0.61 + shift / 24)], element="q2q1"), 3)[0] for shift in (0, 1)]
    assert found[1] == pytest.approx(found[0], rel=2e-3)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_resumed_steps_are_the_same(element):
    whole, states, forces = channel([ends(pulse)], [disc(v=(0.3, 0.2, 0.0))], element=element), [], []
    for number in range(4):
        step(whole, 0.1 * number, 0.1)
        states.append(whole.save())
        forces.append(driving(whole))
    resumed = channel([ends(pulse)], [disc(v=(0.3, 0.2, 0.0))], element=element)
    assert np.isnan(driving(resumed))
    resumed.restore(states[1])
    assert driving(resumed) == forces[1]
    for number in (2, 3):
        step(resumed, 0.1 * number, 0.1)
    assert np.array_equal(resumed.flow, whole.flow)
    assert driving(resumed) == forces[3]


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_the_tangent_is_the_derivative(element):
    """With its part of rank one, around a body."""
    fluid = channel([ends(pulse)], [disc(v=(0.3, 0.2, 0.0))], element=element)
    step(fluid, 0.0, 0.1)
    fluid.begin_step(0.1, 0.1)
    state, iterate = fluid.flow.copy(), fluid.iterate
    fluid.system.set_scales(fluid.velocity())
    iterate.residual()
    matrix = iterate.linearise(picard=False)
    direction = np.random.default_rng(3).normal(size=fluid.size) * ~iterate.held
    x, y = matrix.createVecs()
    x.array[:] = direction
    matrix.mult(x, y)
    found = []
    for sign in (1, -1):
        fluid.flow[:] = state
        fluid.flow[: fluid.size] += sign * 1e-5 * direction
        found.append(iterate.residual().copy())
    difference = (found[0] - found[1]) / 2e-5
    added = iterate.added_product()(direction)
    assert np.abs(y.array + added - difference).max() < 1e-6 * np.abs(difference).max()
    assert np.abs(added).max() > 1e-3 * np.abs(difference).max()


def test_ways_from_period_to_period():
    """A loop counts if it ends in another period than it began: (part at an end, part at the next beginning)."""
    assert not winds([])
    assert not winds([(1, 2)])  # a wall in the middle
    assert winds([(1, 1)])
    assert winds([(1, 2), (2, 1)])  # two strips that lead into one another
    assert not winds([(1, 2), (3, 2), (3, 4)])  # a bay
    assert winds([(5, 6), (1, 2), (3, 2), (3, 4), (1, 3)])


@pytest.mark.parametrize("share", ["through", "closed"])
def test_a_labyrinth(share):
    """Two walls, each with a hole, at which a third one ends or not."""
    gap = 0.3 if share == "through" else -0.1
    walls = [
        body("one", *block([0.3, -0.1], [0.6, 0.7])),
        body("two", *block([1.1, gap], [1.4, 1.1])),
    ]
    fluid = channel([ends(0.02)], walls, n=2, element="q1q1")
    if share == "through":
        assert np.isfinite(run(fluid, 1)[0]).all()
    else:
        with pytest.raises(StepFailed, match="bodies close a period"):
            step(fluid, 0.0, 0.1)


@pytest.mark.parametrize("thickness", [0.1, 0.01])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("linear", ["direct", "iterative"])
def test_a_period_that_a_thin_body_blocks(element, linear, thickness):
    """Cells beside both of its sides share corners, so that it is the equations that have no solution."""
    wall = body("wall", *block([0.83, -0.1], [0.83 + thickness, 1.1]))
    fluid = channel(
        [ends(0.2)], [wall], element=element, solver=SolverSettings(Tolerance(residual=1e-8), linear=linear)
    )
    with pytest.raises(StepFailed):
        print("THIN", run(fluid, 2)[:2], fluid.system.driving.rates(fluid.iterate.values()))
