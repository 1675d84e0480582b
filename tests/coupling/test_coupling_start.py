"""The first steps of coupled runs: accelerations that belong together, and a fluid that knows its past."""

from __future__ import annotations

import numpy as np
import pytest
from coupling_setup import BAR_MODES, TIGHT, bar_and_column, post_in_flow

from coupling.monolithic import Monolithic
from coupling.start import NO_BALANCE, start_together
from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case
from solvers.api import FailureKind, StepFailed

#: A disc of the density of the fluid is let go. Waves cross it in 0.01 s, less than most steps.
DISC = """\
title: A disc starts to fall
time: {{step: {step}, end: {end}}}
fluid:
  density: 1
  viscosity: 1e-4
  element: q1q1
  grid: {{from: [-2, -2], to: [2, 2], cells: [40, 40]}}
  patches:
    walls: {{on: [x-, x+, y-], slip: true}}
    top: {{on: y+, {top}: true}}
{solid}
coupling: {{scheme: {scheme}}}
probes:
  momentum: {{body: disc, quantity: momentum}}
"""
ELASTIC = """structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.5, cells: [32, 2]}
      material: {law: st_venant_kirchhoff, E: 1e4, nu: 0.3, density: 1}
      gravity: [0, -1]"""
#: part of the section `fluid`
RIGID = """  dynamics: {rho_inf: 0.5}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.5, cells: [32, 2]}
      free: {density: 1, gravity: [0, -1]}"""


def rates(folder, *, step=0.02, steps=6, scheme="monolithic", solid=ELASTIC, top="slip"):
    """Rate of the disc's momentum in each step [N]."""
    text = DISC.format(step=step, end=steps * step, scheme=scheme, solid=solid, top=top)
    (folder / "case.yaml").write_text(text)
    case = load_case(folder / "case.yaml")
    assert run_case(case, folder / "run") == FINISHED
    return np.diff(read_history(folder / "run" / "history.csv")["momentum.y"], prepend=0.0) / step


@pytest.mark.parametrize(
    "step", [0.02, pytest.param(0.01, marks=pytest.mark.slow), pytest.param(0.005, marks=pytest.mark.slow)]
)
def test_a_disc_in_fluid_of_its_density_starts_smoothly(step, tmp_path):
    """The rate is within 1 % of a straight line from the first step on; the disc alone would begin with -0.78."""
    found = rates(tmp_path, step=step)
    number = np.arange(len(found))
    line = np.polyval(np.polyfit(number[1:], found[1:], 1), number)
    assert found == pytest.approx(line, rel=0.01)
    assert found[0] == pytest.approx(-0.37, rel=0.01)


def test_both_schemes_start_alike(tmp_path):
    found = []
    for scheme in ("monolithic", "partitioned"):
        (tmp_path / scheme).mkdir()
        found.append(rates(tmp_path / scheme, steps=2, scheme=scheme, top="outflow"))
    assert found[1] == pytest.approx(found[0], rel=1e-4)


def test_order_of_the_start():
    """A bar with ten times its density of fluid at its end, let go in its first mode: the exact way, of order 2.

    With 20 steps in a period the first one is divided; that is as good as second order from 40 steps.
    """
    period = 2.0 * np.pi / BAR_MODES[0.1]
    errors = []
    for steps in (20, 40, 80):
        scheme, dt = Monolithic(bar_and_column(0.1), TIGHT), period / steps
        scheme.initialise(0.0, dt)
        interface = scheme.coupled.interface
        end = int(np.argmax(interface.points[:, 0]))
        found = [interface.now[end, 0]]
        for number in range(steps // 2):
            scheme.step(number * dt, dt)
            found.append(interface.now[end, 0])
        exact = 1e-3 * np.cos(2.0 * np.pi * np.arange(len(found)) / steps)
        errors.append(np.abs(np.array(found) - exact).max())
    assert errors[0] < 4.0 * errors[1]
    assert errors[1] > 4.0 * errors[2]
    assert errors[1] < 0.02 * 1e-3


def test_a_rigid_disc_starts_smoothly(tmp_path):
    found = rates(tmp_path, solid=RIGID)
    number = np.arange(len(found))
    assert found == pytest.approx(np.polyval(np.polyfit(number[1:], found[1:], 1), number), rel=0.01)
    assert found[0] == pytest.approx(-0.37, rel=0.01)


def test_flows_that_start_at_once_have_no_acceleration():
    """A body that moves in fluid at rest; a body at rest in such a fluid may be given one. Rounding is no jump."""
    coupled = bar_and_column(1.0)
    coupled.initialise(0.0, 0.1)
    assert coupled.start is not None
    at_rest = coupled.start.solid.velocity()
    assert coupled.start.flow.jump(coupled.interface.at_start(at_rest), 0.0) == 0.0
    coupled.solid.structure.now.v[:] = 1e-3
    moving = coupled.start.solid.velocity()
    assert np.array_equal(moving, at_rest + 1e-3)
    assert coupled.start.flow.jump(coupled.interface.at_start(moving), 0.0) == pytest.approx(1e-3)
    assert coupled.start.flow.jump(coupled.interface.at_start(moving), 2e3) == 0.0


@pytest.mark.parametrize(("growth", "at_once"), [(lambda t: 1.0, True), (lambda t: t / 0.1, False)])
def test_flows_that_start_at_once_keep_two_steps_of_backward_euler(growth, at_once):
    """The past of others follows from their rate."""
    coupled = post_in_flow(growth=growth)
    Monolithic(coupled, TIGHT).initialise(0.0, 0.01)
    assert coupled.flow.history.steps == (() if at_once else (0.01, 0.01))
    assert np.abs(coupled.flow.history.past[1].velocity).max() == pytest.approx(0.0 if at_once else 0.1, rel=0.2)


def test_a_start_without_balance_is_told():
    """The state is the initial one, and the first step says so once."""

    def fail():
        raise StepFailed("fluid", FailureKind.NEWTON, "no balance")

    scheme = Monolithic(post_in_flow(growth=lambda t: t / 0.1), TIGHT)
    scheme.coupled.initialise(0.0, 0.01)
    before = scheme.coupled.interface.now.copy()
    start_together(scheme.coupled, 0.0, 0.01, fail)
    assert np.array_equal(scheme.coupled.interface.now, before)
    assert scheme.step(0.0, 0.01).notes == (NO_BALANCE.format("no balance"),)
    assert scheme.step(0.01, 0.01).notes == ()


@pytest.mark.parametrize(("cells_moved", "first"), [(0.99, 0.01), (1.01, 0.005), (15.9, 0.0025), (16.1, 0.00125)])
def test_first_steps_that_move_a_body_by_a_cell_are_divided(cells_moved, first):
    """Six steps of the start with the first part h of the step move it by 6 h^2 a, less than a cell."""
    coupled = post_in_flow(growth=lambda t: t / 0.1)
    coupled.initialise(0.0, 0.01)
    assert coupled.start is not None
    cell = coupled.start.flow.smallest_cell
    coupled.solid.structure.now.a[:] = -cells_moved * cell / (6.0 * 0.01**2)
    start_together(coupled, 0.0, 0.01, lambda: None)
    assert coupled.flow.history.steps == pytest.approx((first, first))


@pytest.mark.parametrize("solid", [pytest.param(ELASTIC, marks=pytest.mark.slow), RIGID])
def test_the_length_of_the_first_step_does_not_matter(solid, tmp_path):
    """A disc falls for 0.4 s, in one step, which is divided (6 h^2 a is ten cells), or in eight."""
    momentum = []
    for steps in (1, 8):
        (tmp_path / str(steps)).mkdir()
        step = 0.4 / steps
        momentum.append(step * rates(tmp_path / str(steps), step=step, steps=steps, solid=solid).sum())
    assert momentum[0] == pytest.approx(momentum[1], rel=0.03)
