"""The contact examples of Popp & Wall (COMPDYN 2011) from start to end."""

import json

import numpy as np
import pytest
from programs import fsci

from fsci.history import read_history


def results(out):
    return json.loads((out / "summary.json").read_text()), read_history(out / "history.csv")


def assert_quadratic(residuals):
    """The last drop is at least 1.5 times the one before in orders of magnitude, unless it ends in rounding error.

    Where the program stops because the residual is only rounding error, the drops before that one count.
    """
    drops = -np.diff(np.log10(residuals))
    rounding = residuals[-1] < 1e-11 * residuals[0] and len(drops) > 2
    if rounding and drops[-1] <= 1.5 * drops[-2]:
        drops = drops[:-1]
    assert drops[-1] > 1.5 * drops[-2] or residuals[-1] < 1e-12 * residuals[0], residuals


@pytest.mark.slow
def test_two_tori(tmp_path):
    """200 steps, none retried, at most 6 Newton steps in each; momentum to 1e-9, energy to 1 %."""
    quiet = ["--set", "output.fields_every=0", "--set", "output.residuals=[91, 111, 151]"]
    run = fsci("run", "cases/two_tori", "-o", tmp_path, *quiet, timeout=1200)
    assert run.returncode == 0, run.stdout[-2000:]
    summary, history = results(tmp_path)
    assert summary["steps"] == {"accepted": 200, "retried": 0}
    assert summary["newton"]["max"] <= 6
    for residuals in summary["newton"]["residuals"].values():
        assert_quadratic(residuals)
    momentum = np.stack([history[f"momentum.{axis}"] for axis in "xyz"], axis=1)
    assert np.abs(momentum - momentum[0]).max() < 1e-9 * np.abs(momentum[0]).max()
    energy = history["energy.total"]
    assert energy == pytest.approx(2.0554e7, rel=0.01)
    touching = history["time"][history["contact.active"] > 0]
    assert touching[0] == pytest.approx(2.6, abs=0.1)
    deepest = history["time"][np.argmax(history["energy.internal"])]
    assert deepest == pytest.approx(7.5, abs=0.5)


@pytest.mark.slow
def test_sphere_tube(tmp_path):
    """40 steps, none retried, at most 5 Newton steps in each; the sphere moves as if it were free."""
    run = fsci("run", "cases/sphere_tube", "-o", tmp_path, "--set", "output.fields_every=0", timeout=1200)
    assert run.returncode == 0, run.stdout[-2000:]
    summary, _ = results(tmp_path)
    assert summary["steps"] == {"accepted": 40, "retried": 0}
    assert summary["newton"]["max"] <= 5
    for residuals in summary["newton"]["residuals"].values():
        assert_quadratic(residuals)
