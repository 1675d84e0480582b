"""Two leaflets of 0.3 cells: the flow opens them, its reversal closes and seals, the next pulse opens them again."""

import json

import numpy as np
import pytest
from programs import run_whole

from fsci.running.history import read_history


@pytest.mark.slow
def test_valve_thin(tmp_path):
    run_whole("valve_thin", tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text())["steps"]["retried"] <= 1
    history = read_history(tmp_path / "history.csv")
    time, flow = history["time"], history["flow"]
    touching = time[history["contact.active"] > 0]
    assert touching[0] == pytest.approx(2.2, abs=0.1)
    assert touching[-1] == pytest.approx(3.8, abs=0.1)
    closed = (time > 3.0) & (time < 3.5)
    assert np.abs(flow[closed]).max() < 1e-3 * flow[time < 2.0].max()
    # the pressure from the right is carried by the leaflets
    assert history["right"][closed] - history["left"][closed] == pytest.approx(1.0, abs=0.02)
    assert history["lower.x"][-1] > 0.15
