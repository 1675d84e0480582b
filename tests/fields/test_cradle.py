"""Newton's cradle: five elastic balls in a row, which the first one hits."""

from __future__ import annotations

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

BALL = """\
    ball_{i}:
      mesh: {{shape: disc, radius: 0.5, cells: [{around}, {through}], order: 2, translate: [{x}, 0]}}
      material: {{law: neo_hooke, E: 1.0e+4, nu: 0.3, density: 1}}
"""
PAIR = "    p{i}: {{slave: {{body: ball_{i}, on: outer}}, master: {{body: ball_{j}, on: outer}}}}\n"
PROBES = "  p{i}: {{body: ball_{i}, quantity: momentum}}\n  m{i}: {{body: ball_{i}, quantity: mass}}\n"


def cradle(around, through):
    """With gaps of a fiftieth of the diameter; the first ball has a hundredth of the speed of sound."""
    balls = [BALL.format(i=i, around=around, through=through, x=1.02 * i) for i in range(5)]
    return (
        "time: {step: 0.002, end: 0.5}\nstructure:\n  dynamics: {rho_inf: 0.8}\n  bodies:\n"
        + balls[0]
        + "      initial_velocity: [1, 0]\n"
        + "".join(balls[1:])
        + "contact:\n  pairs:\n"
        + "".join(PAIR.format(i=i, j=i + 1) for i in range(4))
        + "probes:\n"
        + "".join(PROBES.format(i=i) for i in range(5))
        + "output: {fields_every: 0}\n"
    )


@pytest.mark.slow(seconds=80)
@pytest.mark.parametrize(("around", "through", "bar"), [(24, 4, 0.07), (48, 8, 0.03)])
def test_the_last_ball_takes_the_speed_of_the_first(tmp_path, around, through, bar):
    """As equal bars exchange their speeds in one-dimensional wave theory. Cells of half the size: half of the error."""
    (tmp_path / "case.yaml").write_text(cradle(around, through))
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") == FINISHED
    found = read_history(tmp_path / "out" / "history.csv")
    speeds = np.array([found[f"p{i}.x"][-1] / found[f"m{i}"][-1] for i in range(5)])
    assert speeds.sum() == pytest.approx(1.0, abs=1e-8)
    assert speeds[4] == pytest.approx(1.0, abs=bar)
    assert np.abs(speeds[:4]).max() < bar
