"""A free body that leaves the box: the run goes on with a warning, or ends if the case says so."""

import json

import numpy as np
import pytest
from programs import fsci

from fsci.case import CaseError, load_case
from fsci.running.history import read_history

LEAVING = """\
title: a disc leaves
time: {step: 0.02, end: 0.2}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  grid: {from: [0, 0], to: [1, 1], cells: [10, 10]}
  patches:
    walls: {on: [y-, y+, x-], slip: true}
    out: {on: x+, outflow: true}
  bodies:
    disc:
      mesh: {shape: disc, radius: 0.2, translate: [0.97, 0.51], cells: [16, 1]}
      free: {density: 50, initial_velocity: [4, 0]LEAVES}
coupling: {scheme: monolithic}
probes: {centre: {body: disc, quantity: centre}}
output: {fields_every: 0}
"""


def run(folder, leaves, processes=1):
    folder.mkdir()
    (folder / "case.yaml").write_text(LEAVING.replace("LEAVES", leaves))
    done = fsci("run", folder / "case.yaml", "-o", folder / "out", processes=processes)
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json.loads((folder / "out" / "summary.json").read_text())
    return done.stdout, summary, read_history(folder / "out" / "history.csv")


@pytest.fixture(scope="module")
def going_on(tmp_path_factory):
    return run(tmp_path_factory.mktemp("leaves") / "on", "")


def test_it_goes_on_with_a_warning(going_on):
    said, summary, history = going_on
    assert history["time"][-1] == pytest.approx(0.2)
    assert [warned["kind"] for warned in summary["warnings"] if warned["body"] == "disc"][:1] == ["outside"]
    assert "disc has left the box of the fluid; what follows has no meaning for it" in said


@pytest.mark.parametrize("processes", [1, 2])
def test_it_ends_the_run(tmp_path, going_on, processes):
    """After the first step with all of it outside, with exit code 0 and the numbers of the run that goes on."""
    said, summary, history = run(tmp_path / "stop", ", leaves: stop", processes)
    steps = len(history["time"])
    assert np.array_equal(history["centre.x"] - 0.2 > 1.0, [False] * (steps - 1) + [True])
    assert history["centre.x"] == pytest.approx(going_on[2]["centre.x"][:steps], rel=1e-9)
    assert summary["status"] == "finished"
    message = "disc has left the box of the fluid; the run ends, by 'leaves: stop'"
    assert [warned["message"] for warned in summary["warnings"] if warned["kind"] == "outside"] == [message]
    assert f"{message}, at time {history['time'][-1]:g}; finished in" in " ".join(said.split())
    assert list((tmp_path / "stop" / "out").glob("checkpoint*"))


def test_other_words_are_refused(tmp_path):
    (tmp_path / "case.yaml").write_text(LEAVING.replace("LEAVES", ", leaves: ends"))
    with pytest.raises(CaseError, match=r"'leaves' must be 'warn' or 'stop', not 'ends'"):
        load_case(tmp_path / "case.yaml")
