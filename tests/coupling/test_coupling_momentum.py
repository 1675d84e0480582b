"""Momentum and power of fluid and structure, by ways that do not use the interface terms."""

from __future__ import annotations

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, step, wall
from test_coupled_run import MEETING, run

from solvers.fluid.flow.balances import Balances
from solvers.fluid.grid.box import uniform

#: one ball, thrown across the flow and held by nothing
THROWN = """\
title: a ball in a flow
time: {step: 0.02, end: 0.1}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  gravity: [0, -2]
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)*min(t/0.1, 1)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
structure:
  dynamics: {rho_inf: 1}
  bodies:
    ball:
      mesh: {shape: disc, radius: 0.2, cells: [16, 2], translate: [0.78, 0.51]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 5}
      initial_velocity: [0.5, 1]
coupling: {scheme: monolithic}
probes:
  momentum: {quantity: momentum}
  force: {quantity: force}
solver: {newton: {residual: 1.0e-11}}
"""


@pytest.mark.parametrize(
    "scheme", ["monolithic", pytest.param("partitioned, tolerance: 1.0e-10", marks=pytest.mark.slow)]
)
def test_the_ball_gets_what_the_fluid_loses(scheme, tmp_path):
    """Its momentum changes by dt times the mean of the forces before and after a step (rho_inf = 1), and the force is
    what inertia, walls and outlet of the fluid leave over. Both to what the solvers leave: 1e-11 of the force.

    The first step takes the impulse of the start by backward Euler, and the run starts again from its end.
    """
    history = run(THROWN.replace("scheme: monolithic", f"scheme: {scheme}"), tmp_path)
    largest = np.abs(history["force.y"]).max()
    assert largest > 1
    assert history["interface.momentum"].max() < 1e-10 * largest
    for axis in "xy":
        momentum, force = history[f"momentum.{axis}"], history[f"force.{axis}"]
        mean = 0.5 * (force[2:] + force[1:-1])
        assert np.abs(np.diff(momentum[1:]) / 0.02 - mean).max() < 1e-8 * largest


def test_forces_of_contact_are_not_of_the_fluid(tmp_path):
    """Two balls that meet: the momentum of the fluid gives the fluid's force alone."""
    history = run(MEETING, tmp_path, ("solver.newton.residual", "1e-11"))
    assert history["contact.active"].max() > 0
    assert history["interface.momentum"].max() < 1e-9 * np.abs(history["force.x"]).max()
    assert history["interface.force"].max() < 1e-9


@pytest.mark.parametrize(("element", "scheme"), [("q1q1", "bdf2"), ("q2q1", "backward_euler")])
def test_a_flow_that_the_grid_has_exactly_loses_nothing(element, scheme):
    """Shear past a disc that moves with it: all power of the walls is dissipated, mu (du/dy)^2 times the fluid's area.

    Without a disc that does, Nitsche's method and stabilisation take their part of the power.
    """
    mu, rate, points = 0.3, 2.0, circle((0.47, 0.52), 0.2, 24)
    shear = field(lambda x, y, t: rate * y, 0.0)
    for moves in (True, False):
        velocity = np.stack([rate * points[:, 1] * moves, 0.0 * points[:, 0]], axis=1)
        fluid = make_fluid(
            uniform([0, 0], [1, 1], [8, 8]), [wall(shear)], [body("disc", points, loop(24), velocity=velocity)],
            mu=mu, element=element, scheme=scheme, dt=0.1, initial_velocity=shear,
        )  # fmt: skip
        for number in range(2):
            step(fluid, 0.1 * number, 0.1)
        balances = Balances(fluid.system)
        force = fluid.force()["disc"]
        dissipated = mu * rate**2 * (1 - np.pi * 0.2**2)
        on_bodies, lost, _ = balances(fluid.iterate.held)
        assert np.abs(on_bodies - force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
        if moves:
            assert abs(lost) < 1e-11 * dissipated
        else:
            assert lost > 1e-3 * dissipated


def test_power_of_the_interface(tmp_path):
    """On a stiff ball it is force times velocity, which is that of the centre with backward Euler."""
    text = THROWN.replace("E: 500", "E: 5e5").replace("probes:", "probes:\n  centre: {quantity: centre}")
    history = run(text, tmp_path, ("fluid.scheme", "backward_euler"))
    expected = sum(history[f"force.{axis}"][1:] * np.diff(history[f"centre.{axis}"]) / 0.02 for axis in "xy")
    assert history["interface.power"][1:] == pytest.approx(expected, rel=0.01)
    assert (history["fluid.loss"] > 0).all()
