"""A cylinder oscillates in fluid at rest (Duetsch et al., J. Fluid Mech. 360 (1998) 249-271): Re 100, KC 5."""

import numpy as np
import pytest
from fluid_setup import body, circle, loop, make_fluid, step
from scipy.signal import butter, sosfiltfilt

from fsci.bench.fluid import graded
from solvers.fluid.grid.box import Grid
from solvers.fluid.terms.boundary.patches import Patch
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

FREQUENCY, AMPLITUDE = 0.2, 5.0 / (2.0 * np.pi)


def oscillate(scheme, steps, periods, cells, *, element="q1q1", grow=1.2, **settings):
    """(t, force) for a number of steps in a period and of cells along the diameter 1; largest velocity 1."""
    turn, dt, h = 2.0 * np.pi * FREQUENCY, 1.0 / (FREQUENCY * steps), 1.0 / cells

    def motion(points, t):
        moved = points - np.array([AMPLITUDE * np.sin(turn * t), 0.0])
        return moved, 0 * points - np.array([AMPLITUDE * turn * np.cos(turn * t), 0.0])

    x = graded(-25.0, 25.0, (-1.75 + 0.013 * h, 1.75 + 0.013 * h), h, grow, 3.0)
    y = graded(-15.0, 15.0, (-1.0 + 0.29 * h, 1.0 + 0.29 * h), h, grow, 2.5)
    cylinder = body("cylinder", circle((0, 0), 0.5, 200), loop(200), motion=motion)
    fluid = make_fluid(
        Grid((x, y)), [Patch("ends", ("x-", "x+"), "outflow"), Patch("sides", ("y-", "y+"), "slip")], [cylinder],
        mu=0.01, element=element, scheme=scheme, dt=dt, solver=SolverSettings(Tolerance(1e-6)), **settings,
    )  # fmt: skip
    force = []
    for number in range(round(periods * steps)):
        step(fluid, number * dt, dt)
        force.append(fluid.force()["cylinder"].sum(axis=0))
    return dt * np.arange(1, len(force) + 1), np.array(force)


def morison(t, force):
    """(c_d, c_i) of F = -1/2 c_d |U| U - pi/4 c_i dU/dt over the last period."""
    turn = 2.0 * np.pi * FREQUENCY
    last = t > t[-1] - 1.0 / FREQUENCY + 1e-9
    velocity, acceleration = -np.cos(turn * t[last]), turn * np.sin(turn * t[last])
    columns = np.stack([-0.5 * np.abs(velocity) * velocity, -0.25 * np.pi * acceleration], axis=1)
    return np.linalg.lstsq(columns, force[last, 0], rcond=None)[0]


def noise(t, force):
    """Root mean square of what is faster than nine times the motion, relative to the amplitude, in the last period."""
    last = t > t[-1] - 1.0 / FREQUENCY + 1e-9
    fast = butter(2, 9 * FREQUENCY, "highpass", fs=1.0 / (t[1] - t[0]), output="sos")
    inside = last & (t < t[-1] - 0.1 / FREQUENCY)
    return sosfiltfilt(fast, force[:, 0])[inside].std() / (0.5 * np.ptp(force[last, 0]))


@pytest.mark.slow
def test_force_is_smooth_while_cells_come_and_go():
    """Backward Euler: the noise is below 1 % of the amplitude and does not grow when the step is halved."""
    coarse, fine = (noise(*oscillate("backward_euler", steps, 2, 10)) for steps in (50, 100))
    assert coarse < 0.01
    assert fine < 1.1 * coarse


@pytest.mark.slow
def test_noise_of_the_second_order_scheme():
    """BDF2: below 1 % of the amplitude too; halving the step does not double it (Lehrenfeld, Olshanskii 2019)."""
    coarse, fine = (noise(*oscillate("bdf2", steps, 2, 10)) for steps in (50, 100))
    assert fine < 0.01
    assert fine < 1.5 * coarse


@pytest.mark.slow
def test_drag_of_the_oscillating_cylinder():
    """Duetsch et al.: c_d 2.09, c_i 1.45, and the largest coefficient of drag 3.30, after two periods."""
    t, force = oscillate("bdf2", 50, 2, 20)
    drag, inertia = morison(t, force)
    largest = 2.0 * np.abs(force[t > t[-1] - 1.0 / FREQUENCY, 0]).max()
    assert drag == pytest.approx(2.09, rel=0.03)
    assert inertia == pytest.approx(1.45, rel=0.03)
    assert largest == pytest.approx(3.30, rel=0.03)
