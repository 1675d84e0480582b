"""Velocities of the steps behind: known wherever a body was within a step, also after a restart."""

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, nodal_errors, step, wall

from solvers.api import StepFailed
from solvers.fluid.flow.history import History, Past
from solvers.fluid.grid.box import uniform
from solvers.fluid.settings.time_scheme import SCHEMES, FlowStep
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion

VELOCITY, DT = field(2.0, 0.0), 0.01


def block_in_uniform_flow(scheme="bdf2"):
    """A block that another field moves with the velocity of a uniform flow, which it does not disturb."""
    points, facets = block([0.23, 0.32], [0.57, 0.66])
    body = ImmersedBody(ImmersedSurface("block", facets, len(points)), motion=None)
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [20, 20]),
        [wall(VELOCITY)],
        [body],
        dt=DT,
        initial_velocity=VELOCITY,
        mu=0.1,
        scheme=scheme,
    )
    return fluid, points


def place(fluid, points, x, speed=2.0):
    fluid.move({"block": Motion(points + np.array([x, 0.0]), 0 * points + np.array([speed, 0.0]))})


def advance(fluid, points, number, x, *, hasty=False):
    """A step to x; hasty: with a first iterate so fast that a wide strip is solved for."""
    fluid.begin_step(number * DT, DT)
    if hasty:
        place(fluid, points, x, 20.0)
    place(fluid, points, x)
    fluid.solve()
    fluid.end_step()


def test_velocities_before_the_start_follow_the_rate():
    """u(-k dt) = u(0) - k dt du/dt: BDF2 finds this rate in the first step."""
    history, dt = History(SCHEMES["bdf2"], 2), 0.25
    rate = np.array([3.0, -2.0])
    history.start(np.array([1.0, 5.0]))
    history.continue_back(dt, rate, np.array([True, False]))
    assert history.past[1].velocity == pytest.approx([0.25, 5.5])
    assert list(history.past[1].found) == [True, False]
    difference = history.difference(dt)
    assert difference.alpha * (history.past[0].velocity + dt * rate) - history.rate(difference) == pytest.approx(rate)


@pytest.mark.parametrize("scheme", ["bdf2", "bdf2_optimized"])
def test_restart_knows_all_that_the_steps_knew(scheme):
    """More cells stay active through a step than its last iterate asks for; the next step may need them."""
    fluid, points = block_in_uniform_flow(scheme)
    place(fluid, points, 0.0)
    for number in range(3):
        advance(fluid, points, number, 0.02 * (number + 1), hasty=True)
    other, _ = block_in_uniform_flow(scheme)
    other.restore(fluid.save())
    for some in (fluid, other):
        advance(some, points, 3, 0.25)
    assert np.allclose(other.flow, fluid.flow, rtol=0, atol=1e-11)
    u, _ = nodal_errors(fluid, VELOCITY, lambda x, t: 0 * x[0], 0.0, level=True)
    assert u < 1e-9


def test_restart_among_cells_that_come_and_go():
    """Bit for bit: also the matrix is as it was, with room for bodies where they were before."""

    def make():
        way = np.array([1.0, 0.0])
        disc = body("disc", circle((0.3, 0.5), 0.15, 40), loop(40), motion=lambda x, t: (x + t * way, 0 * x + way))
        return make_fluid(uniform([0, 0], [1, 1], [20, 20]), [wall(field(0, 0))], [disc], mu=0.1, dt=DT)

    fluid = make()
    for number in range(10):
        step(fluid, number * DT, DT)
    other = make()
    other.restore(fluid.save())
    for number in range(10, 25):
        for some in (fluid, other):
            step(some, number * DT, DT)
        assert np.array_equal(other.flow, fluid.flow)


def test_block_that_was_nowhere_near_is_an_error():
    fluid, points = block_in_uniform_flow()
    place(fluid, points, 0.0)
    for number in range(3):
        advance(fluid, points, number, 0.02 * (number + 1))
    with pytest.raises(StepFailed, match=r"3\.8 cells from where the step began"):
        advance(fluid, points, 3, 0.25)


def test_initial_velocity_is_defined_inside_bodies():
    fluid, points = block_in_uniform_flow()
    place(fluid, points, 0.0)
    fluid.begin_step(0.0, DT)
    x, y = fluid.unknowns.velocity.dofs.T
    assert np.array_equal(fluid.history.rate(fluid.current.difference)[x], np.full(len(x), 2.0 / DT))
    assert np.array_equal(fluid.history.rate(fluid.current.difference)[y], np.zeros(len(y)))


def test_first_guess_goes_on_as_in_the_last_step():
    """Where the velocity was known at both times behind, and not on the boundary; with half the step, half as far."""
    fluid = make_fluid(uniform([0, 0], [1, 1], [4, 4]), [wall(VELOCITY)], dt=DT, initial_velocity=VELOCITY)
    x = fluid.unknowns.velocity.dofs[:, 0]
    inside = ~np.isin(x, fluid.parts.boundary.dofs)
    missing = np.zeros(fluid.unknowns.local, dtype=bool)
    missing[x[inside][0]] = True
    values = [np.where(np.isin(np.arange(fluid.unknowns.local), x), value, 0.0) for value in (3.0, 5.0)]
    fluid.history.past = [Past(values[1], ~missing), Past(values[0], ~missing)]
    fluid.history.steps = (DT, DT)
    fluid.flow[:] = values[1]
    fluid.current = FlowStep(0.5 * DT, 0.5 * DT, fluid.history.difference(0.5 * DT))
    fluid.predict()
    guess = fluid.flow[x[inside]]
    assert guess[0] == 5.0
    assert guess[1:] == pytest.approx(6.0, rel=1e-14)
    assert np.array_equal(fluid.flow[x[~inside]], np.full(np.count_nonzero(~inside), 5.0))
