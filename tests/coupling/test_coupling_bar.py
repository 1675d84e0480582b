"""An elastic bar against a column of fluid: exact frequency, exact limit of plain iterations."""

from __future__ import annotations

import numpy as np
import pytest
from advised import require_advice
from coupling_setup import BAR_MODES, TIGHT, bar_and_column, contraction

from coupling.accelerate import Aitken, QuasiNewton, Relaxation
from coupling.monolithic import Monolithic
from coupling.partitioned import FixedPointTolerance, Partitioned
from solvers.api import FailureKind, StepFailed


def swing(scheme, dt: float, steps: int):
    """(displacement of the end after each step, iterations of each step)."""
    coupled = scheme.coupled
    coupled.initialise(0.0, dt)
    end = int(np.argmax(coupled.interface.points[:, 0]))
    found, iterations = [], []
    for step in range(steps):
        info = scheme.step(step * dt, dt)
        found.append(coupled.interface.now[end, 0])
        iterations.append(info.iterations)
    return np.array(found), iterations


def zeros(values: np.ndarray, dt: float) -> np.ndarray:
    """Times at which a piecewise linear function changes sign; its first value is at dt."""
    t = dt * (1 + np.arange(len(values)))
    change = np.flatnonzero(values[1:] * values[:-1] < 0.0)
    return t[change] - values[change] * dt / (values[change + 1] - values[change])


@pytest.mark.parametrize(
    "ratio", [pytest.param(10.0, marks=pytest.mark.slow), pytest.param(1.0, marks=pytest.mark.slow), 0.1]
)
def test_frequency(ratio: float):
    omega = BAR_MODES[ratio]
    dt = 2.0 * np.pi / omega / 60.0
    end, iterations = swing(Monolithic(bar_and_column(ratio), TIGHT), dt, 80)
    crossings = zeros(end, dt)
    assert np.pi / (crossings[1] - crossings[0]) == pytest.approx(omega, rel=0.005)
    assert max(iterations) <= 3


@pytest.mark.parametrize(
    "accelerator", [pytest.param(Aitken(0.5), marks=pytest.mark.slow), QuasiNewton(0.5)], ids=["aitken", "iqn"]
)
def test_both_schemes_take_the_same_way(accelerator):
    """25 steps with the heavy fluid, ratio 0.1, and some with the light one."""
    for ratio, steps in ((0.1, 25), (10.0, 5)):
        one, newton = swing(Monolithic(bar_and_column(ratio), TIGHT), 0.1, steps)
        two, _ = swing(Partitioned(bar_and_column(ratio), accelerator, FixedPointTolerance(1e-7)), 0.1, steps)
        assert np.abs(one - two).max() < 10 * 1e-7 * np.abs(one).max()
        assert np.ptp(one) > 0.01 * np.abs(one).max()  # it moves
        assert max(newton) <= 3


def test_steps_begin_on_the_parabola_through_the_last_displacements(monkeypatch):
    """After the cut of the old place, which cells that the surface leaves in this step need."""
    dt, steps = 0.1, 6
    scheme = Partitioned(bar_and_column(1.0), QuasiNewton(0.5), FixedPointTolerance(1e-9))
    interface = scheme.coupled.interface
    scheme.coupled.initialise(0.0, dt)
    places, tried, move = [interface.displacement()], [], interface.move
    monkeypatch.setattr(interface, "move", lambda d: tried.append(d.copy()) or move(d))
    for step in range(steps):
        tried.clear()
        before = interface.now.copy()
        scheme.step(step * dt, dt)
        assert np.array_equal(tried[0], before)
        if step >= 2:
            a, b, c = places[-3:]
            assert tried[1] == pytest.approx(a - 3.0 * b + 3.0 * c, rel=1e-12, abs=1e-15)
        places.append(interface.displacement())


@pytest.mark.parametrize("times_limit", [0.8, 1.25])
def test_plain_iterations_on_both_sides_of_their_limit(times_limit: float):
    """The factor is that of the added mass, and beyond 1 plain iterations diverge."""
    dt, cells = 0.2, 10
    unit = contraction(dt, cells)  # with rho_f L = 1
    density = times_limit / unit
    coupled = bar_and_column(1.0, density=density, cells=cells, amplitude=1e-6)
    coupled.initialise(0.0, dt)
    scheme = Partitioned(coupled, Relaxation(1.0), FixedPointTolerance(1e-12, 0.0, max_iterations=14))
    with pytest.raises(StepFailed) as failure:
        scheme.step(0.0, dt)
    require_advice(failure.value, FailureKind.COUPLING)
    history = failure.value.history
    assert history[-1] / history[-2] == pytest.approx(times_limit, rel=0.02)
