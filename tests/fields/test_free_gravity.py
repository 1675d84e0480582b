"""The gravity of free bodies is that of the flow unless they have their own; a check says which bodies differ."""

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: A disc of the density of the water around it, off the planes of the grid.
FLOATING = """\
title: a disc that floats
time: {step: 0.05, end: 0.2}
fluid:
  density: 1000
  viscosity: 1
  element: q1q1
  gravity: [3, -9]
  grid: {from: [0, 0], to: [1, 1], cells: [10, 10]}
  patches: {walls: {on: [x-, x+, y-, y+], no_slip: true}}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, translate: [0.533, 0.467], cells: [24, 2]}
      free: {density: 1000}
coupling: {scheme: monolithic}
probes: {centre: {body: disc, quantity: centre}, momentum: {body: disc, quantity: momentum}}
"""
ELASTIC = """\
structure:
  dynamics: {}
  bodies:
    block:
      mesh: {shape: rectangle, size: [0.2, 0.1], cells: [2, 2], translate: [0.05, 0.05]}
      material: {law: neo_hooke, E: 1e6, nu: 0.3, density: 1000}
"""


def load(text, folder, *overrides):
    (folder / "case.yaml").write_text(text)
    return load_case(folder / "case.yaml", overrides)


def moved(folder, *overrides):
    folder.mkdir()
    assert run_case(load(FLOATING, folder, *overrides), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
def test_a_body_of_the_flows_density_floats_at_rest(tmp_path, scheme):
    """Weight and buoyancy balance, whatever the gravity: without a weight the disc would rise by some 0.06."""
    history = moved(tmp_path / "floating", ("coupling.scheme", scheme))
    for axis, place in (("x", 0.533), ("y", 0.467)):
        assert history[f"centre.{axis}"] == pytest.approx(np.full(4, place), abs=1e-8)


def test_it_is_the_gravity_that_it_would_be_given(tmp_path):
    """Bit for bit; zeros are no weight, so that the body rises against the gravity of the flow."""
    key = "fluid.bodies.disc.free"
    heavy = (f"{key}.density", "3000")
    default = moved(tmp_path / "default", heavy)
    given = moved(tmp_path / "given", heavy, (f"{key}.gravity", "[3, -9]"))
    none = moved(tmp_path / "none", heavy, (f"{key}.gravity", "[0, 0]"))
    for axis in "xy":
        assert np.array_equal(default[f"centre.{axis}"], given[f"centre.{axis}"])
    assert default["momentum.y"][-1] < -1.0
    assert none["momentum.y"][-1] > 1.0


def test_a_flow_without_gravity_gives_none(tmp_path):
    case = load(FLOATING.replace("  gravity: [3, -9]\n", ""), tmp_path)
    assert case.fluid.free_bodies["disc"].gravity is None


@pytest.mark.parametrize(
    ("gravity", "warned"),
    [("[3, -9]", False), ("[0, 0]", False), ("[0, -9]", True), ("[3, '-9*min(t/0.1, 1)']", True), ("[-3, 9]", True)],
)
def test_a_body_with_another_gravity_than_the_flow(tmp_path, gravity, warned):
    text = FLOATING.replace("free: {density: 1000}", f"free: {{density: 1000, gravity: {gravity}}}")
    found = [line for line in load(text, tmp_path).warnings if "gravity" in line]
    assert bool(found) == warned
    if warned:
        (line,) = found
        assert "case.yaml:13:" in line
        assert "the gravity of the body is not that of the flow: weight and buoyancy differ" in line


@pytest.mark.parametrize(
    ("material", "warned"),
    [
        ("density: 1000}", True),
        ("density: 1000}\n      gravity: [0, 0]", False),
        ("density: 1000}\n      gravity: [3, -9]", False),
    ],
)
def test_an_elastic_body_without_gravity_in_a_flow_that_has_it(tmp_path, material, warned):
    """Elastic bodies have their own gravity only: a check says so where the flow has some."""
    case = load(FLOATING + ELASTIC.replace("density: 1000}", material), tmp_path)
    found = [line for line in case.warnings if "gravity" in line]
    assert bool(found) == warned
    if warned:
        assert "the flow has gravity, the body has none: buoyancy acts on it, but no weight" in found[0]


def test_check_says_whose_gravity_a_body_has(tmp_path):
    from fsci.check.check import summary

    assert "disc, rigid, free, gravity of the flow" in summary(load(FLOATING, tmp_path))
    own = load(FLOATING, tmp_path, ("fluid.bodies.disc.free.gravity", "[0, 0]"))
    assert "gravity of the flow" not in summary(own)


def test_a_hinged_body_of_the_flows_density_floats_at_rest(tmp_path):
    """About a pivot beside its centre, weight and buoyancy have no moment together."""
    history = moved(tmp_path / "a", ("fluid.bodies.disc.free.pivot", "[0.42, 0.55]"))
    for axis, place in (("x", 0.533), ("y", 0.467)):
        assert history[f"centre.{axis}"] == pytest.approx(np.full(4, place), abs=1e-8)


def test_a_given_force_carries_the_rest_of_the_weight(tmp_path):
    """Half as heavy again as the fluid, held by the force (rho_b - rho) V g upwards, V that of the polygon."""
    volume = 0.5 * 24 * 0.2**2 * np.sin(np.radians(15.0))
    force = f"[{{force: [{-1500 * volume}, {4500 * volume}]}}]"
    free = "fluid.bodies.disc.free"
    history = moved(tmp_path / "a", (f"{free}.density", "1500"), (f"{free}.loads", force))
    for axis, place in (("x", 0.533), ("y", 0.467)):
        assert history[f"centre.{axis}"] == pytest.approx(np.full(4, place), abs=1e-8)
