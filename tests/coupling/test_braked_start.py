"""A free disc that the flow brakes within a small part of the first step: its place and velocity after this step."""

from __future__ import annotations

import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: It has its terminal velocity after about 0.1 s. With scale 1e-3 all lengths are that much shorter, at the same times.
DISC = """\
time: {{step: {step}, end: 0.5}}
fluid:
  density: 1
  viscosity: {viscosity}
  flow: stokes
  scheme: {rule}
  grid: {{from: [{low}, {low}], to: [{high}, {high}], cells: [16, 16]}}
  patches: {{walls: {{on: [x-, x+, y-, y+], no_slip: true}}}}
  bodies:
    disc: {{mesh: {{shape: disc, radius: {radius}, cells: [24, 1]}}, free: {{density: 2, gravity: [0, {gravity}]}}}}
coupling: {{scheme: {scheme}}}
probes:
  v: {{body: disc, quantity: velocity, at: [0, 0]}}
  c: {{body: disc, quantity: centre}}
output: {{fields_every: 0}}
"""


def last(folder, step: float, scheme: str, scale: float, rule: str) -> tuple[float, float]:
    """Place and velocity at 0.5 s, over the scale."""
    text = DISC.format(step=step, viscosity=scale**2, low=-scale, high=scale, radius=0.25 * scale,
                       gravity=-0.5 * scale, scheme=scheme, rule=rule)  # fmt: skip
    folder.mkdir()
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    found = read_history(folder / "out" / "history.csv")
    return found["c.y"][-1] / scale, found["v.y"][-1] / scale


@pytest.mark.parametrize(
    ("scheme", "scale", "rule"),
    [
        ("monolithic", 1.0, "bdf2"),
        pytest.param("monolithic", 1e-3, "bdf2", marks=pytest.mark.slow),
        pytest.param("partitioned", 1.0, "bdf2", marks=pytest.mark.slow),
        pytest.param("monolithic", 1.0, "backward_euler", marks=pytest.mark.slow),
        ("partitioned", 1e-3, "backward_euler"),
    ],
)
def test_the_first_step_resolves_how_the_flow_brakes_the_body(tmp_path, scheme, scale, rule):
    place, velocity = last(tmp_path / "short", 0.025, "monolithic", 1.0, rule)
    found = last(tmp_path / "long", 0.5, scheme, scale, rule)
    assert found[0] == pytest.approx(place, rel=0.06)
    assert found[1] == pytest.approx(velocity, rel=0.2)
