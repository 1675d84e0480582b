"""Bodies that sink in very viscous fluid, in steps of many relaxation times: drag is soon their weight."""

from __future__ import annotations

import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case

SCENE = """\
title: Disc settles in a very viscous fluid
time: {{step: {step}, end: {end}}}
fluid:
  density: 1
  viscosity: {viscosity}
  element: q1q1
  flow: stokes
  scheme: {scheme}
  grid: {{from: [-1, -1.5], to: [1, 1.5], cells: [20, 30]}}
  patches: {{walls: {{on: [x-, x+, y-, y+], no_slip: true}}}}
  bodies:
    disc: {{mesh: {{shape: disc, radius: 0.25, cells: [48, 1], translate: [{x}, {y}]}}, {motion}}}
{coupling}
probes: {{{probe}}}
output: {{fields_every: 0}}
"""
FREE = {
    "motion": "free: {density: 2, gravity: [0, -0.5]}",
    "probe": "v: {body: disc, quantity: velocity, at: [0, 0]}, c: {body: disc, quantity: centre}, "
    "m: {body: disc, quantity: mass}",
}
SPEED = 1e-6
GIVEN = {"motion": f'motion: {{displacement: [0, "-{SPEED} * t"]}}', "probe": "f: {body: disc, quantity: force}"}


def run(folder, **settings):
    folder.mkdir()
    (folder / "case.yaml").write_text(SCENE.format(**settings))
    assert run_case(load_case(folder / "case.yaml"), folder / "run") == FINISHED
    return read_history(folder / "run" / "history.csv")


@pytest.mark.parametrize(
    ("scheme", "coupling", "step", "x", "viscosity"),
    [
        ("bdf2", "monolithic", 0.5, 0.0, 1.0),
        pytest.param("bdf2_optimized", "monolithic", 0.25, 1 / 30, 1.0, marks=pytest.mark.slow),
        pytest.param("backward_euler", "monolithic", 0.5, 0.0, 1e3, marks=pytest.mark.slow),
        pytest.param("bdf2", "partitioned", 0.5, 1 / 30, 1.0, marks=pytest.mark.slow),
    ],
)
def test_a_disc_sinks_with_its_terminal_velocity(tmp_path, scheme, coupling, step, x, viscosity):
    """By default; a time scheme without damping let its velocity jump about this value for ever."""
    settings = {"step": step, "end": 12 * step, "x": x, "y": 0.0, "viscosity": viscosity, "scheme": scheme}
    sinking = run(tmp_path / "free", coupling=f"coupling: {{scheme: {coupling}}}", **settings, **FREE)
    there = settings | {"y": sinking["c.y"][-1]}
    drag = run(tmp_path / "given", coupling="", **there, **GIVEN)["f.y"][-1] / SPEED
    assert sinking["v.y"][-2:] == pytest.approx(-0.5 * sinking["m"][-1] / drag, rel=0.005)


def test_it_goes_on_after_a_change_of_the_step(tmp_path):
    settings = {"step": 0.5, "end": 3, "x": 0.0, "y": 0.0, "viscosity": 1.0, "scheme": "bdf2"}
    before = run(tmp_path / "free", coupling="coupling: {scheme: monolithic}", **settings, **FREE)["v.y"][-1]
    assert resume_run(tmp_path / "free" / "run", [("time.end", "4"), ("time.step", "0.1")]) == FINISHED
    after = read_history(tmp_path / "free" / "run" / "history.csv")["v.y"][6:]
    assert len(after) == 10
    assert after == pytest.approx(before, rel=0.01)
