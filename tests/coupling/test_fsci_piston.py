"""A column of fluid pushes a block against a stop: exact way, impact and pressure at rest (references of the docs)."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from programs import run_whole

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: time: way, velocity and pressure on the block; P = rho = L0 = m_s = 1, gap 0.1
EXACT = {
    0.2: (0.009991686, 0.09983391416, 0.4975144957),
    0.4: (0.03986789523, 0.1986850168, 0.4902278242),
    0.6: (0.08933877538, 0.2956364658, 0.4786203232),
}
IMPACT, VELOCITY, IMPULSE, HEIGHT = 0.6350681354, 0.3123785017, 0.6559948536, 0.2


@pytest.mark.slow
def test_piston_with_impact(tmp_path):
    run_whole("piston_impact", tmp_path)
    history = read_history(tmp_path / "history.csv")
    t, d = history["time"], history["block.x"] - 1.25
    v, pressure = history["momentum.x"] / HEIGHT, history["force.x"] / HEIGHT
    contact = -history["contact.stop.x"] / HEIGHT
    for time, exact in EXACT.items():
        i = int(np.argmin(np.abs(t - time)))
        assert [d[i], v[i], pressure[i]] == pytest.approx(exact, rel=2e-4)
    last = int(np.flatnonzero(history["contact.active"] > 0)[0]) - 1
    rest = (0.1 - d[last]) / v[last]
    acceleration = (v[last] - v[last - 1]) / (t[last] - t[last - 1])
    assert t[last] + rest == pytest.approx(IMPACT, rel=1e-4)
    assert v[last] + acceleration * rest == pytest.approx(VELOCITY, rel=2e-4)
    # the impact step and the ring-down after it: no retry, impulse of a plastic stop, then the pressure of the inlet
    assert len(t) == 720
    stop = (contact[last + 1 :] * history["dt"][last + 1 :]).sum() - (t[-1] - t[last])
    assert stop == pytest.approx(IMPULSE, rel=5e-4)
    assert contact[-1] == pytest.approx(1.0, rel=1e-6)
    assert pressure[-1] == pytest.approx(1.0, rel=1e-6)
    assert np.abs(v[-1]) < 1e-11


@pytest.mark.parametrize("coupling", ["monolithic", pytest.param("partitioned", marks=pytest.mark.slow)])
def test_a_stopped_column_does_not_pull(tmp_path, coupling):
    """By default schemes, with a gap of 1 mm: the block stays at the stop, and carries the pressure of the inlet.

    BDF2 alone gave half of the impulse back, and the midpoint rule turned the damped motions round: it left the stop
    with a quarter of its velocity.
    """
    text = Path("cases/piston_impact/case.yaml").read_text()
    for before, after in (
        ("  scheme: backward_euler\n", ""),
        ("rho_inf: 0, ", ""),
        ("origin: [1.6, -0.1]", "origin: [1.501, -0.1]"),
        ("end: 0.9", "end: 0.12"),
        ("coupling: {", f"coupling: {{scheme: {coupling}, "),
    ):
        assert before in text
        text = text.replace(before, after)
    (tmp_path / "case.yaml").write_text(text.split("# exact for a rigid block")[0])
    assert run_case(load_case(tmp_path), tmp_path / "run") == FINISHED
    history = read_history(tmp_path / "run" / "history.csv")
    momentum, closed = history["momentum.x"], history["contact.active"] > 0
    first = int(np.flatnonzero(closed)[0])
    assert momentum[first - 1] == pytest.approx(0.2 * math.sqrt(0.001), rel=0.02)
    assert momentum[first + 1 :].min() > -0.02 * momentum[first - 1]
    assert -history["contact.stop.x"][-10:].mean() == pytest.approx(0.2, rel=0.01)
    assert history["force.x"][-10:].mean() == pytest.approx(0.2, rel=0.01)
