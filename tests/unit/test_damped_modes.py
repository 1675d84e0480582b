"""Damping with `rho_inf: 1`: motions that a step does not resolve alternate, and `check` says so."""

import numpy as np
import pytest
from programs import fsci

from fsci.case import load_case
from fsci.check.damped_modes import largest_square
from fsci.check.meshes import check_meshes
from fsci.running.history import read_history

#: A bar of two cells, compressed from one instant on: its middle has w^2 = 3 E / (density h^2) = 3, and x = 15.
BAR = """\
time: {step: 1, end: 8}
structure:
  dynamics: {rho_inf: 1, damping: {stiffness: 10}}
  bodies:
    bar:
      kinematics: linear
      mesh: {shape: rectangle, size: [1, 2], order: 1, cells: [1, 2]}
      material: {law: neo_hooke, E: 1, nu: 0, density: 1}
      supports:
        - {on: bottom, displacement: [0, 0]}
        - {on: top, displacement: [0, "-0.01*t"]}
        - {on: [left, right], displacement: [0, null]}
probes: {top: {quantity: reaction, body: bar, on: top}}
solver: {newton: {residual: 1e-12}}
"""


def notes(folder, *changes):
    text = BAR
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "case.yaml").write_text(text)
    return check_meshes(load_case(folder / "case.yaml")).notes


def test_reactions_alternate_as_check_says(tmp_path):
    """x is 60 by the estimate, which leaves out that the bar has one free node; the factor of a step is -14 / 16."""
    assert notes(tmp_path) == [
        f"{tmp_path}/case.yaml:3:13: 'damping' ends the finest motions of body 'bar' within a step, and 'rho_inf: 1' "
        "turns them round in each: after a jump of a support or load, reactions alternate for about 30 steps; take "
        "'rho_inf: 0.9', or let it begin smoothly"
    ]
    done = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    change = np.diff(read_history(tmp_path / "out" / "history.csv")["top.y"], n=3)  # without the slow motion
    np.testing.assert_allclose(change[1:] / change[:-1], -14 / 16, rtol=0.01)


@pytest.mark.parametrize(
    "change",
    [
        ("rho_inf: 1", "rho_inf: 0.9"),
        ("stiffness: 10", "mass: 10"),
        ("stiffness: 10", "stiffness: 0.1"),
        ("density: 1", "density: 100"),
        ("step: 1", "step: 0.01"),
    ],
)
def test_what_a_step_resolves_is_not_named(tmp_path, change):
    assert notes(tmp_path, change) == []


def test_the_largest_frequency_of_a_bar(tmp_path):
    """That of many linear elements with consistent masses is 12 E / (density h^2)."""
    n, h, E, density = 40, 0.05, 7.0, 3.0
    stiffness = np.diag(np.full(n - 1, 2.0)) - np.eye(n - 1, k=1) - np.eye(n - 1, k=-1)
    mass = np.diag(np.full(n - 1, 4.0)) + np.eye(n - 1, k=1) + np.eye(n - 1, k=-1)
    exact = np.linalg.eigvals(np.linalg.solve(density * h / 6 * mass, E / h * stiffness)).real.max()
    notes(
        tmp_path,
        ("[1, 2]}", f"[{n}, 1]}}"),
        ("size: [1, 2]", f"size: [{n * h}, 1]"),
        ("E: 1", f"E: {E}"),
        ("density: 1", f"density: {density}"),
    )
    case = load_case(tmp_path / "case.yaml")
    assert largest_square(case, "bar", check_meshes(case).meshes["bar"]) == pytest.approx(exact, rel=0.01)
