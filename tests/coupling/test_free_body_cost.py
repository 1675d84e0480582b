"""A free ball in a flow takes as many Newton steps as a ball that is moved: its motion is solved with the first one."""

from __future__ import annotations

import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

BALL = """\
time: {{step: 0.1, end: 0.3}}
fluid:
  density: 1
  viscosity: {viscosity}
  flow: stokes
  scheme: bdf2
  element: q1q1
  grid: {{from: [{low}, {low}, {low}], to: [{high}, {high}, {high}], cells: [10, 10, 10]}}
  patches: {{walls: {{on: [x-, x+, y-, y+, z-, z+], no_slip: true}}}}
  bodies: {{ball: {{mesh: {{shape: sphere, radius: {radius}, cells: [6, 1], translate: [0, 0, {at}]}}, {moves}}}}}
solver: {{linear: {{method: iterative}}}}
output: {{fields_every: 0}}
"""


def iterations(folder, scale: float, moves: str, more: str = "") -> list[int]:
    """Newton steps of each step of time from the second one on."""
    lengths = {"low": -scale, "high": scale, "radius": 0.4 * scale, "at": 0.1 * scale, "viscosity": scale**2}
    folder.mkdir()
    (folder / "case.yaml").write_text(BALL.format(moves=moves, **lengths) + more)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return [int(count) for count in read_history(folder / "out" / "history.csv")["iterations"][1:]]


@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_a_free_ball_takes_as_many_newton_steps_as_one_that_is_moved(tmp_path, scale):
    moved = iterations(tmp_path / "moved", scale, f'motion: {{displacement: [0, 0, "{-0.018 * scale}*t"]}}')
    free = f"free: {{density: 2, gravity: [0, 0, {-scale}]}}"
    found = iterations(tmp_path / "free", scale, free, "coupling: {scheme: monolithic}\n")
    assert max(found) <= max(moved)
