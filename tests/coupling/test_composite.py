"""Elastic and free rigid bodies in one flow: what each does alone, momentum, restart, processes, mistakes."""

from __future__ import annotations

import re

import numpy as np
import pytest
from programs import fsci

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case

ELASTIC = """\
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    flap:
      mesh: {shape: rectangle, size: [0.1, 0.5], origin: [0.45, 0], cells: [2, 5]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 3}
      gravity: [1, 0]
      supports: [{on: bottom, displacement: [0, 0]}]
"""
FREE = """\
    disc:
      mesh: {shape: disc, radius: 0.2, cells: [24, 1], translate: [1.72, 0.6]}
      free: {density: 3, gravity: [0.5, -1]}
"""

#: The flap as a body at rest: other bodies make other cells thin, wherever they are.
STILL = "    flap: {mesh: {shape: rectangle, size: [0.1, 0.5], origin: [0.45, 0], cells: [2, 5]}}\n"

#: Two chambers with a wall between them, each with an opening of its own: what moves in one is not felt in the other.
SCENE = """\
time: {{step: 0.05, end: 0.15}}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  grid: {{from: [0, 0], to: [2.2, 1], cells: [22, 10]}}
  patches:
    left: {{on: x-, traction: [0, 0]}}
    right: {{on: x+, traction: [0, 0]}}
    walls: {{on: [y-, y+], no_slip: true}}
{dynamics}  bodies:
    wall: {{mesh: {{shape: rectangle, size: [0.43, 1.4], origin: [0.91, -0.2], cells: [1, 1]}}}}
{free}{elastic}coupling: {{scheme: {scheme}{tolerance}}}
probes:
{probes}
output: {{fields_every: 0}}
solver: {{newton: {{residual: 1.0e-11}}}}
"""
OF_FLAP = """\
  tip: {body: flap, quantity: displacement, at: [0.55, 0.5]}
  on_flap: {field: fluid, body: flap, quantity: force}
"""
OF_DISC = """\
  centre: {body: disc, quantity: centre}
  on_disc: {field: fluid, body: disc, quantity: force}
  momentum: {body: disc, quantity: momentum}
"""


def scene(scheme: str, *, elastic: bool = True, free: bool = True) -> str:
    return SCENE.format(
        scheme=scheme,
        tolerance="" if scheme == "monolithic" else ", tolerance: 1.0e-11",
        elastic=ELASTIC if elastic else "",
        dynamics="" if elastic else "  dynamics: {rho_inf: 0.8}\n",  # else the disc has that of the flap
        free=(FREE if free else "") + ("" if elastic else STILL),
        probes=(OF_FLAP if elastic else "") + (OF_DISC if free else ""),
    )


def run(text: str, folder):
    folder.mkdir()
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """History of both bodies."""
    return run(scene("monolithic"), tmp_path_factory.mktemp("composite") / "both")


@pytest.mark.parametrize("scheme", ["monolithic", pytest.param("partitioned", marks=pytest.mark.slow)])
def test_each_moves_as_it_does_alone(scheme, tmp_path, whole):
    """The start, the iteration and the balances of both kinds are those of each kind alone."""
    both = whole if scheme == "monolithic" else run(scene(scheme), tmp_path / "both")
    flap = run(scene(scheme, free=False), tmp_path / "flap")
    disc = run(scene(scheme, elastic=False), tmp_path / "disc")
    assert abs(both["tip.x"][-1]) > 1e-4
    assert both["centre.y"][-1] < 0.6 - 1e-4
    for alone in (flap, disc):
        for column in alone:
            if column.split(".")[0] in ("tip", "on_flap", "centre", "on_disc", "momentum"):
                size = np.abs(alone[column]).max()
                np.testing.assert_allclose(both[column], alone[column], rtol=0.0, atol=1e-8 * size, err_msg=column)
    assert both["interface.force"][1:].max() < 1e-9  # the first force belongs to the start steps


@pytest.mark.slow
def test_both_schemes_agree(tmp_path):
    """Without the wall they feel each other: the same by both schemes."""
    open_scene = lambda scheme: re.sub("    wall:.*\n", "", scene(scheme))  # noqa: E731
    one, two = (run(open_scene(scheme), tmp_path / scheme) for scheme in ("monolithic", "partitioned"))
    for column in ("tip.x", "centre.x", "centre.y", "on_disc.y"):
        np.testing.assert_allclose(one[column], two[column], rtol=1e-5, atol=1e-8)


def test_the_momentum_of_both_is_the_impulse_of_all_forces(tmp_path):
    """A box of fluid without walls that hold it: what the bodies gain is what gravity and the fluid give them."""
    free = re.sub("      supports.*\n", "", scene("monolithic")).replace("gravity: [1, 0]", "gravity: [1, -0.4]")
    free = free.replace("origin: [0.45, 0]", "origin: [0.35, 0.23]").replace("at: [0.55, 0.5]", "at: [0.35, 0.23]")
    free = free.replace("probes:\n", "probes:\n  of_flap: {body: flap, quantity: momentum, field: structure}\n")
    free = free.replace("rho_inf: 0.8", "rho_inf: 1")
    found = run(free, tmp_path / "free")
    dt, volume = 0.05, {"flap": 3.0 * 0.05, "disc": None}
    for name, own, axis, g in (("flap", "of_flap", "x", 1.0), ("flap", "of_flap", "y", -0.4)):
        force = found[f"on_{name}.{axis}"]
        rate = np.diff(found[f"{own}.{axis}"]) / dt
        assert rate == pytest.approx(0.5 * (force[1:] + force[:-1]) + volume[name] * g, rel=1e-6, abs=1e-7)
    mass = 3.0 * 24 * 0.5 * 0.2**2 * np.sin(2.0 * np.pi / 24)
    for axis, g in (("x", 0.5), ("y", -1.0)):
        force = found[f"on_disc.{axis}"]
        rate = np.diff(found[f"momentum.{axis}"]) / dt
        assert rate == pytest.approx(0.5 * (force[1:] + force[:-1]) + mass * g, rel=1e-6, abs=1e-7)


def test_a_thrown_disc_shares_its_momentum_beside_an_elastic_body(tmp_path):
    """The impulsive start is that of the disc alone, where the elastic body is behind a wall."""

    def thrown(**parts) -> str:
        velocity = "density: 3, initial_velocity: [0.3, 0], gravity: [0.5"
        return scene("monolithic", **parts).replace("density: 3, gravity: [0.5", velocity)

    both, alone = run(thrown(), tmp_path / "both"), run(thrown(elastic=False), tmp_path / "alone")
    for column in ("centre.x", "momentum.x", "on_disc.x"):
        np.testing.assert_allclose(both[column], alone[column], rtol=1e-7, atol=1e-9)


def test_a_resumed_run_is_the_same(tmp_path, whole):
    text = scene("monolithic").replace("end: 0.15", "end: 0.1")
    run(text, tmp_path / "part")
    assert resume_run(tmp_path / "part" / "out", [("time.end", "0.15")]) == FINISHED
    part = read_history(tmp_path / "part" / "out" / "history.csv")
    for column in ("tip.x", "centre.y", "on_disc.y", "on_flap.x"):
        assert np.array_equal(part[column], whole[column]), column


def test_check_names_both(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(scene("monolithic"))
    done = fsci("check", path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "rigid, free" in done.stdout
