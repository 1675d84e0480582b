"""Three cusps of 0.3 cells in a tube: the flow opens them, its reversal closes and seals, the next pulse opens them."""

import json
from math import pi, sin

import numpy as np
import pytest
from programs import run_whole

from fsci.running.history import read_history


@pytest.mark.slow(seconds=900)
def test_valve_3d(tmp_path):
    """Closed, each cusp carries the pressure on a third of the tube, whose cross-section is a polygon of 48 sides."""
    run_whole("valve_3d", tmp_path, timeout=2400)
    assert json.loads((tmp_path / "summary.json").read_text())["steps"]["retried"] == 0
    history = read_history(tmp_path / "history.csv")
    time, flow = history["time"], history["flow"]
    touching = time[history["contact.active"] > 0]
    assert 1.8 < touching[0] < touching[-1] < 4.7
    closed = (time > 3.95) & (time < 4.35)
    assert np.abs(flow[closed]).max() < 2e-3 * flow[time < 2.0].max()
    assert history["above"][closed] - history["below"][closed] == pytest.approx(1.5, abs=0.01)
    third = 24 * sin(pi / 24) / 3
    assert -history["cusp.z"][closed] == pytest.approx(1.5 * third, rel=0.01)
    pairs = np.array([[history[f"contact.{pair}.{i}"] for i in "xyz"] for pair in ("a_b", "b_c", "c_a")])
    assert np.abs(pairs[:, :2, closed].sum(axis=0)).max() < 0.05 * np.abs(pairs[:, :, closed]).max()
    assert flow[-1] > 0.3
