"""Contact of elastic bodies with free rigid ones in a flow."""

from __future__ import annotations

import numpy as np
import pytest
from programs import fsci

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case

#: A heavy disc settles on an elastic plate in a viscous fluid.
SCENE = """\
time: {step: 0.05, end: 1.6}
fluid:
  density: 1
  viscosity: 0.5
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 0.8], cells: [12, 10]}
  patches:
    top: {on: y+, traction: [0, 0]}
    walls: {on: [x-, x+, y-], no_slip: true}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.5, 0.351]}
      free: {density: 20, gravity: [0, -10], held: [x, rotation]}
  dynamics: {rho_inf: 0}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    plate:
      mesh: {shape: rectangle, size: [0.6, 0.2], origin: [0.2, 0], cells: [12, 4]}
      material: {law: neo_hooke, E: 3000, nu: 0.3, density: 2}
      supports: [{on: bottom, displacement: [0, 0]}]
contact:
  pairs: {press: {slave: {body: plate, on: top}, master: {obstacle: disc}}}
coupling: {scheme: monolithic}
probes:
  centre: {body: disc, quantity: centre}
  momentum: {body: disc, quantity: momentum}
  on_disc: {field: fluid, body: disc, quantity: force}
output: {fields_every: 0}
"""
WEIGHT = 200.0 * 24 * 0.5 * 0.15**2 * np.sin(2.0 * np.pi / 24)
PUSHED = SCENE.replace("gravity: [0, -10], held: [x, rotation]", "gravity: [2, -10]").replace("end: 1.6", "end: 0.2")


def run(text, folder):
    folder.mkdir()
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def settled(tmp_path_factory):
    return run(SCENE, tmp_path_factory.mktemp("settled") / "case")


def test_at_rest_contact_carries_the_weight(settled):
    """What the fluid does not."""
    assert abs(settled["momentum.y"][-1]) < 1e-6 * WEIGHT
    assert -settled["contact.press.y"][-1] == pytest.approx(WEIGHT - settled["on_disc.y"][-1], rel=1e-6)
    assert settled["centre.y"][-1] < 0.35 - 0.004
    assert settled["interface.force"].max() < 1e-6


def test_momentum_passes_whole(settled):
    """What the disc gains is the mean of the forces on it, with the weights of the two time schemes, in each step."""
    alpha, fluid = 0.5 / 1.5, settled["on_disc.y"]
    pressed = -settled["contact.press.y"]
    rate = np.diff(settled["momentum.y"]) / 0.05
    by_contact = (1.0 - alpha) * pressed[1:] + alpha * pressed[:-1]
    # rho_inf = 0 of the disc: alpha_m = -1, alpha_f = 0, gamma = 1.5; its own mean is of the rates p
    p = [rate[0]]
    for n in range(1, len(rate)):
        p.append((rate[n] + 0.5 * p[-1]) / 1.5)
    assert by_contact[-5:] + fluid[-5:] - WEIGHT == pytest.approx(np.zeros(5), abs=1e-3)
    assert np.abs(rate[-5:]).max() < 1e-3


def test_a_rigid_disc_is_a_stiff_one(settled, tmp_path):
    """Of a thousand times the stiffness, in the same place."""
    stiff = SCENE.replace("  dynamics: {rho_inf: 0}\n", "").replace(
        "structure:\n  dynamics: {rho_inf: 0.5}\n  bodies:\n",
        "structure:\n  dynamics: {rho_inf: 0.5}\n  bodies:\n    disc:\n"
        "      mesh: {shape: disc, radius: 0.15, cells: [24, 3], translate: [0.5, 0.351]}\n"
        "      material: {law: neo_hooke, E: 3.0e+6, nu: 0.3, density: 20}\n      gravity: [0, -10]\n",
    )
    start, end = (
        stiff.index("  bodies:\n    disc:\n      mesh: {shape: disc, radius: 0.15, cells: [24, 1]"),
        stiff.index("structure:"),
    )
    stiff = (stiff[:start] + stiff[end:]).replace("{obstacle: disc}", "{body: disc, on: outer}")
    stiff = stiff.replace("{body: disc, quantity: centre}", "{field: structure, body: disc, quantity: centre}")
    found = run(
        stiff.replace("{body: disc, quantity: momentum}", "{field: structure, body: disc, quantity: momentum}"),
        tmp_path / "stiff",
    )
    sunk = 0.351 - settled["centre.y"][-1]
    assert 0.351 - found["centre.y"][-1] == pytest.approx(sunk, rel=0.01)


@pytest.mark.slow
def test_both_schemes_agree(tmp_path):
    one = run(PUSHED, tmp_path / "one")
    two = run(PUSHED.replace("scheme: monolithic", "scheme: partitioned, tolerance: 1.0e-9"), tmp_path / "two")
    for column in ("centre.x", "centre.y", "contact.press.x", "contact.press.y"):
        np.testing.assert_allclose(two[column], one[column], rtol=1e-4, atol=1e-6)


@pytest.mark.slow
def test_a_resumed_run_is_the_same(tmp_path):
    whole = run(PUSHED, tmp_path / "whole")
    run(PUSHED.replace("end: 0.2", "end: 0.1"), tmp_path / "part")
    assert resume_run(tmp_path / "part" / "out", [("time.end", "0.2")]) == FINISHED
    part = read_history(tmp_path / "part" / "out" / "history.csv")
    for column in ("centre.x", "centre.y", "contact.press.y", "on_disc.y"):
        assert np.array_equal(part[column], whole[column]), column


@pytest.mark.slow
def test_two_processes(tmp_path):
    one = run(PUSHED, tmp_path / "one")
    path = tmp_path / "two.yaml"
    path.write_text(PUSHED)
    done = fsci("run", path, "-o", tmp_path / "two", processes=2)
    assert done.returncode == 0, done.stdout + done.stderr
    two = read_history(tmp_path / "two" / "history.csv")
    for column in ("centre.x", "centre.y", "contact.press.y"):
        np.testing.assert_allclose(two[column], one[column], rtol=1e-7, atol=1e-9, err_msg=column)
