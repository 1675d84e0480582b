"""Cases from Python: results of `fsci run`, step by step and in a folder, and what cannot be."""

import numpy as np
import pytest

import fsci
from fsci.running.history import read_history
from solvers.api import StepFailed

#: A strip that snaps within its third step of four: dynamics finds it with half of the step.
STRIP = """
title: strip
time: {step: 0.25, end: 1, retry: {halvings: 2}}
structure:
  bodies:
    strip:
      mesh: {shape: rectangle, size: [4, 1], cells: [8, 2]}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, 0]}]
      tractions: [{on: right, value: [0, "-t"]}]
  dynamics: {rho_inf: 0.8}
solver: {newton: {max_iterations: 4}}
probes: {tip: {body: strip, quantity: displacement, at: [4, 1]}}
"""


@pytest.fixture
def strip(tmp_path):
    (tmp_path / "case.yaml").write_text(STRIP)
    return tmp_path / "case.yaml"


def test_steps_are_those_of_a_run(strip, tmp_path):
    """Bit for bit, halved steps included; a run in a folder has the same columns and the fields of the last step."""
    settings = {"structure.bodies.strip.tractions.0.value": [0, "-30*t"]}
    case = fsci.load(strip, settings)
    results = fsci.run(case, tmp_path / "out")
    steps = fsci.build(case)
    assert steps.probes()["tip.y"] == 0.0
    found = [(time, steps.probes()["tip.y"]) for time in steps]
    assert results.summary["status"] == "finished"
    assert min(results["dt"]) < 0.25  # else nothing was halved
    assert [list(column) for column in zip(*found, strict=True)] == [list(results["time"]), list(results["tip.y"])]
    assert steps.info is not None
    assert steps.info.iterations == results["iterations"][-1]
    mesh = results.fields()["strip"]
    corner = np.argmin(np.linalg.norm(mesh.points - mesh.point_data["displacement"] - [4, 1, 0], axis=1))
    assert mesh.point_data["displacement"][corner, 1] == pytest.approx(results["tip.y"][-1], rel=1e-6)
    now = steps.fields()["strip"]
    assert now.point_data["displacement"][:, 1].min() == pytest.approx(
        mesh.point_data["displacement"][:, 1].min(), rel=1e-6
    )
    assert results.fields(time=0.0)["strip"].point_data["displacement"].max() == 0.0
    again = fsci.results(tmp_path / "out")
    assert again.history.keys() == read_history(tmp_path / "out" / "history.csv").keys()


def test_settings_are_values_of_python(strip):
    """Numbers of numpy, lists, texts and None; what a value may not be is refused as in the file."""
    material = "structure.bodies.strip.material"
    case = fsci.load(strip, {f"{material}.E": np.float64(3e7), f"{material}.nu": 0.25, "title": "a: b", "probes": None})
    body = case.elastic_bodies["strip"]
    assert (body.material.E.constant, body.material.nu.constant) == (3e7, 0.25)
    assert (case.title, dict(case.probes)) == ("a: b", {})
    assert fsci.load(strip, {"structure.bodies.strip.mesh.cells": np.array([4, 1])}).elastic_bodies["strip"]
    for wrong in (float("nan"), "stiff", [1.0]):
        with pytest.raises(fsci.CaseError, match=r"--set structure\.bodies\.strip\.material\.E"):
            fsci.load(strip, {f"{material}.E": wrong})


def test_a_failed_run_has_its_results(strip, tmp_path):
    """Its message is that of the program, and the steps until then are there; taken alone, the step fails alike."""
    settings = {"structure.bodies.strip.tractions.0.value": [0, "-1e5*max(t - 0.5, 0)"]}
    with pytest.raises(fsci.RunFailed, match=r"step 3 from time 0\.5 failed with dt = 0\.0625: structure") as failed:
        fsci.run(fsci.load(strip, settings), tmp_path / "out")
    assert list(failed.value.results["time"]) == [0.25, 0.5]
    steps = fsci.build(fsci.load(strip, settings))
    with pytest.raises(StepFailed):
        list(steps)
    assert steps.time == 0.5
    assert steps.probes()["tip.y"] == failed.value.results["tip.y"][-1]


def test_what_is_not_there_is_named(strip, tmp_path):
    with pytest.raises(fsci.CaseError, match="has no results of a run"):
        fsci.results(tmp_path)
    results = fsci.run(fsci.load(strip), tmp_path / "out")
    with pytest.raises(KeyError, match=r"no column 'tip\.z' in .*did you mean 'tip\.[xy]'\?; it has step, time"):
        results["tip.z"]
    with pytest.raises(AttributeError, match="module 'fsci' has no attribute 'lod'"):
        fsci.lod  # noqa: B018
