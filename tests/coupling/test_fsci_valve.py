"""Two leaflets that a pulsating flow opens, closes on each other, and opens again."""

from __future__ import annotations

import json

import numpy as np
import pytest
from programs import run_whole

from fsci.running.history import read_history


@pytest.mark.slow
def test_valve(tmp_path):
    run_whole("valve", tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text())["steps"] == {"accepted": 150, "retried": 0}
    history = read_history(tmp_path / "history.csv")
    touching = history["time"][history["contact.active"] > 0]
    assert 2.1 < touching[0] < touching[-1] < 2.7
    before = history["time"] < touching[0]
    assert np.abs(history["lower.y"] + history["upper.y"])[before].max() < 1e-6
