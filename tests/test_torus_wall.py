"""The demonstration from start to end on a coarse grid: a torus is carried to the wall and pressed against it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from programs import fsci

from fsci.history import read_history

COARSE = {
    "fluid.grid.cells": "[8, 8, 13]",
    "structure.bodies.torus.mesh.cells": "[16, 8]",
    "time.step": "0.01",
    "output.fields_every": "0",
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Folder of the run."""
    out = tmp_path_factory.mktemp("torus") / "out"
    changes = [word for key, value in COARSE.items() for word in ("--set", f"{key}={value}")]
    done = fsci("run", "cases/torus_wall", "-o", out, *changes, timeout=900)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return out


@pytest.fixture(scope="module")
def history(run):
    return read_history(run / "history.csv")


def test_it_arrives_and_is_pressed_against_the_wall(history):
    """It starts 1.15 m above the wall; the contact force grows after first contact."""
    touching = history["contact.active"] > 0
    assert history["gap"][0] == pytest.approx(1.15, abs=0.05)
    assert 0.38 < history["time"][touching][0] < 0.46
    assert history["contact.wall.z"][-1] > 10.0
    assert not touching[: len(touching) // 2].any()


def test_nothing_is_lost_on_the_way(history):
    """Action is reaction, volume of fluid and torus stay, and nothing goes through the wall."""
    assert history["interface.force"].max() < 1e-12
    inflow = 10.0 * (4.0 / 3.0) ** 2
    assert np.abs(history["fluid.mass"]).max() < 1e-3 * inflow
    assert history["gap"].min() > -1e-10
    assert np.abs(history["volume"] / history["volume"][0] - 1.0).max() < 0.05


def test_it_runs_without_repeated_steps(run):
    summary = json.loads((run / "summary.json").read_text())
    assert summary["status"] == "finished"
    assert summary["steps"]["retried"] <= 2
