"""The run loop: results folder, verification, retry, stop, resume, failure, number of processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from programs import fsci, start_fsci

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FAILED, FINISHED, STOPPED, resume_run, run_case
from solvers.api import FailureKind, StepFailed

CASE = """\
title: a swinging beam
time: {step: 0.05, end: 1.0}
structure:
  dynamics: {rho_inf: 0.9}
  bodies:
    beam:
      mesh: {shape: rectangle, size: [2, 0.5], cells: [6, 2], order: 2}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1.0}
      supports: [{on: left, displacement: [0, 0]}]
      gravity: [0, "-3*sin(3*t)"]
      pressures: [{on: top, value: "0.2*t"}]
probes:
  tip: {quantity: displacement, at: [2, 0.25]}
  wall: {quantity: reaction, on: left}
  energy: {quantity: energy}
output: {checkpoint_every: 4, residuals: [2]}
verify:
  - {value: tip.y, statistic: min, reference: -1.0, absolute: 0.5}
"""


@pytest.fixture
def case(tmp_path):
    (tmp_path / "case.yaml").write_text(CASE)
    return tmp_path / "case.yaml"


def final_state(out):
    from fsci.running.checkpoint import read_checkpoint

    state, _ = read_checkpoint(out / "checkpoint")
    return {name: state["scheme"][name]["beam"] for name in ("u", "v", "a")}


def test_results_folder(case, tmp_path):
    out = tmp_path / "out"
    assert run_case(load_case(case), out) == FINISHED
    summary = json.loads((out / "summary.json").read_text())
    history = read_history(out / "history.csv")
    assert summary["status"] == "finished"
    assert summary["processes"] == 1
    assert summary["dofs"] == {"structure": 2 * 13 * 5}
    assert summary["steps"] == {"accepted": 20, "retried": 0}
    assert summary["newton"]["total"] == history["iterations"].sum()
    assert len(summary["newton"]["residuals"]["2"]) == history["iterations"][1] + 1
    assert summary["probes"]["tip.y"]["min"] == history["tip.y"].min()
    assert {"total", "assembly", "solve", "output"} <= summary["wall"].keys()
    assert summary["verify"][0]["ok"]
    assert list(history)[:5] == ["step", "time", "dt", "iterations", "wall"]
    assert history["time"] == pytest.approx(0.05 * np.arange(1, 21), abs=1e-12)
    assert len(list((out / "fields").glob("beam_*.vtu"))) == 21
    # a support holds what inertia, gravity and pressure leave: the energy balance knows all of them
    assert abs(summary["balances"]["structure.energy"]["final"]) < 0.01 * summary["probes"]["energy.kinetic"]["max"]


def test_fields_are_the_deformed_body(case, tmp_path):
    import meshio

    out = tmp_path / "out"
    run_case(load_case(case), out)
    mesh = meshio.read(out / "fields" / "beam_000020.vtu")
    displacement = mesh.point_data["displacement"]
    tip = np.argmin(np.linalg.norm(mesh.points - displacement - [2, 0.25, 0], axis=1))
    history = read_history(out / "history.csv")
    assert displacement[tip, :2] == pytest.approx([history["tip.x"][-1], history["tip.y"][-1]], abs=1e-14)


def test_missed_verification(case, tmp_path):
    loaded = load_case(case, [("verify.0.reference", "5")])
    assert run_case(loaded, tmp_path / "out") == FAILED
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "finished"
    assert not summary["verify"][0]["ok"]


class FailsAt:
    """A scheme that fails at some calls, half way through the step."""

    def __init__(self, scheme, calls, history=(1.0, 2.0)):
        self.scheme, self.calls, self.history, self.count = scheme, calls, history, 0

    def step(self, t, dt):
        self.count += 1
        info = self.scheme.step(t, dt)
        if self.count in self.calls:
            raise StepFailed(
                "structure", FailureKind.NEWTON, "injected", iteration=3, where=(1.0, 2.0), history=self.history
            )
        return info

    def __getattr__(self, name):
        return getattr(self.scheme, name)


def inject(monkeypatch, calls, **options):
    import fsci.builder.build

    original = fsci.builder.build.build

    def build(*arguments):
        simulation = original(*arguments)
        return replace(simulation, scheme=FailsAt(simulation.scheme, calls, **options))

    monkeypatch.setattr(fsci.builder.build, "build", build)


def test_retry(case, tmp_path, monkeypatch):
    """A failed step is repeated as two halves; the step size recovers; the result is that of halved steps."""
    inject(monkeypatch, {4})
    assert run_case(load_case(case, [("time.retry.recover_after", "2")]), tmp_path / "out") == FINISHED
    history = read_history(tmp_path / "out" / "history.csv")
    assert history["dt"] == pytest.approx([0.05] * 3 + [0.025] * 2 + [0.05] * 16)
    assert history["time"][-1] == 1.0
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["steps"] == {"accepted": 21, "retried": 1}


def test_retry_restores_the_state(case, tmp_path, monkeypatch):
    """Failing once at full size and then stepping by halves equals a run that never tried the full step."""
    short = [("time.end", "0.05"), ("verify", "[]")]
    assert run_case(load_case(case, [*short, ("time.step", "0.025")]), tmp_path / "halves") == FINISHED
    inject(monkeypatch, {1})
    assert run_case(load_case(case, short), tmp_path / "retried") == FINISHED
    first, second = (read_history(tmp_path / name / "history.csv")["tip.y"] for name in ("halves", "retried"))
    assert first == pytest.approx(second, rel=1e-9)


def test_failure_is_named_and_kept(case, tmp_path, monkeypatch, capfd):
    inject(monkeypatch, set(range(4, 100)))
    out = tmp_path / "out"
    assert run_case(load_case(case, [("time.retry.halvings", "2")]), out) == FAILED
    failure = json.loads((out / "failure" / "failure.json").read_text())
    assert failure["reason"] == "injected"
    assert failure["step"] == 4
    assert failure["dt"] == 0.0125
    assert failure["where"] == [1.0, 2.0]
    assert (out / "failure" / "case.yaml").exists()
    assert list((out / "failure" / "fields").glob("*.vtu"))
    assert list((out / "failure").glob("checkpoint_*.h5"))
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"] == "failed"
    assert summary["steps"] == {"accepted": 3, "retried": 2}
    expected = "step 4 from time 0.15 failed with dt = 0.0125: structure: injected at iteration 3 near (1, 2)"
    assert expected in capfd.readouterr().out


def test_halving_stops_where_it_changes_nothing(case, tmp_path, monkeypatch, capfd):
    """Two attempts in a row with the same residuals."""
    inject(monkeypatch, set(range(4, 100)), history=(1.0, 5.0, 4.0, 5.0, 4.0))
    assert run_case(load_case(case, [("time.retry.halvings", "4")]), tmp_path / "out") == FAILED
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["steps"] == {"accepted": 3, "retried": 1}
    assert "injected; as with twice the step, so that shorter ones do not help at iteration 3" in capfd.readouterr().out


def test_inverted_element_is_named(case, tmp_path, capfd):
    """A body pressed flat in one step: the message says which element, where."""
    press = [
        ("structure.bodies.beam.material.law", "st_venant_kirchhoff"),
        ("structure.bodies.beam.supports.0.on", "[left, right, bottom]"),
        ("structure.bodies.beam.pressures.0.value", "1e4"),
        ("time.retry.halvings", "0"),
    ]
    assert run_case(load_case(case, press), tmp_path / "out") == FAILED
    assert "element of body 'beam' inverted (volume ratio -" in capfd.readouterr().out


def test_resume_is_bitwise(case, tmp_path):
    """Stopping by a file, then resuming, changes no bit; the history is whole."""
    straight, broken = tmp_path / "straight", tmp_path / "broken"
    case.write_text(CASE.replace("step: 0.05", "step: 0.008"))  # long enough to be stopped on the way
    assert run_case(load_case(case), straight) == FINISHED

    process = start_fsci("run", case, "-o", broken)
    while not (broken / "history.csv").exists() or len((broken / "history.csv").read_text().splitlines()) < 5:
        time.sleep(0.002)
        assert process.poll() is None
    (broken / "STOP").touch()
    process.communicate(timeout=60)
    assert process.returncode == STOPPED
    summary = json.loads((broken / "summary.json").read_text())
    assert summary["status"] == "stopped"
    assert summary["steps"]["accepted"] < 125
    assert fsci("resume", broken).returncode == FINISHED
    one, two = final_state(straight), final_state(broken)
    for name in one:
        assert np.array_equal(one[name], two[name])
    first, second = (read_history(folder / "history.csv") for folder in (straight, broken))
    for name in first.keys() - {"wall"}:
        assert np.array_equal(first[name], second[name]), name


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signal_writes_a_checkpoint(case, tmp_path, number):
    out = tmp_path / "out"
    process = start_fsci("run", case, "-o", out, "--set", "time.end=1000")
    while not (out / "history.csv").exists() or len((out / "history.csv").read_text().splitlines()) < 3:
        time.sleep(0.01)
        assert process.poll() is None
    process.send_signal(number)
    process.communicate(timeout=60)
    assert process.returncode == STOPPED
    assert json.loads((out / "summary.json").read_text())["status"] == "stopped"
    assert list((out / "checkpoint").glob("checkpoint_*.h5"))


def test_resume_without_checkpoint(case, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "case.yaml").write_text(CASE)
    result = fsci("resume", out)
    assert result.returncode == FAILED
    assert "no usable checkpoint" in result.stderr
    assert "Traceback" not in result.stderr


def test_resume_of_another_version(case, tmp_path, monkeypatch, capsys):
    """Its checkpoint lacks something that this version keeps."""
    import fsci.running.run as run
    from fsci.cli import execute

    out = tmp_path / "out"
    assert run_case(load_case(case, [("time.end", "0.2"), ("verify", "[]")]), out) == FINISHED
    read = run.read_checkpoint

    def older(folder):
        state, path = read(folder)
        del state["scheme"]["v"]
        return state, path

    monkeypatch.setattr(run, "read_checkpoint", older)
    assert execute(["resume", str(out), "--set", "time.end=0.3"]) == FAILED
    error = capsys.readouterr().err
    assert "the checkpoint has no entry 'v': another version of fsci wrote it; run the case again" in error


def test_resume_with_other_settings(case, tmp_path):
    """It goes on with them from the checkpoint, and the folder's case has them; what the state depends on stays."""
    out = tmp_path / "out"
    assert run_case(load_case(case, [("time.end", "0.2"), ("verify", "[]")]), out) == FINISHED
    assert resume_run(out, [("time.end", "0.3"), ("time.step", "0.025"), ("output.checkpoint_every", "0")]) == FINISHED
    history = read_history(out / "history.csv")
    assert history["time"] == pytest.approx([0.05, 0.1, 0.15, 0.2, 0.225, 0.25, 0.275, 0.3])
    assert (load_case(out).time.step, load_case(out).output.checkpoint_every) == (0.025, 0)

    text = (out / "case.yaml").read_text()
    for change, message in (
        (("time.end", "0.25"), "--set time.end=0.25: 'end' must be later than 0.3, the time of the checkpoint"),
        (
            ("time.start", "0.1"),
            "--set time.start=0.1: time.start was 0, is 0.1: it cannot change when a run is resumed",
        ),
        (
            ("structure.bodies.beam.element", "mixed"),
            "--set structure.bodies.beam.element=mixed: structure.bodies.beam.",
        ),
        (("solver.newton.max_iteration", "3"), "--set solver.newton.max_iteration=3: unknown setting 'max_iteration'"),
    ):
        with pytest.raises(CaseError) as caught:
            resume_run(out, [change])
        assert str(caught.value).startswith(message)
    assert (out / "case.yaml").read_text() == text


def test_processes_agree(case, tmp_path):
    """1 and 2 processes, and a run that goes on with 2 where 1 stopped, agree to 1e-9."""
    alone, pair, mixed = tmp_path / "alone", tmp_path / "pair", tmp_path / "mixed"
    assert fsci("run", case, "-o", alone).returncode == FINISHED
    assert fsci("run", case, "-o", pair, processes=2).returncode == FINISHED
    assert fsci("run", case, "-o", mixed, "--set", "time.end=0.5", "--set", "verify=[]").returncode == FINISHED
    assert fsci("resume", mixed, "--set", "time.end=1.0", processes=2).returncode == FINISHED
    assert load_case(mixed).time.end == 1.0
    one = final_state(alone)
    for other in (final_state(pair), final_state(mixed)):
        for name, values in one.items():
            assert np.abs(values - other[name]).max() < 1e-9 * np.abs(values).max(), name
    history = read_history(alone / "history.csv"), read_history(pair / "history.csv")
    for name in ("tip.x", "tip.y", "wall.x", "wall.y", "energy.total"):
        assert history[0][name] == pytest.approx(history[1][name], rel=1e-8, abs=1e-9), name


def test_loads_nothing_it_does_not_need(case):
    """`fsci check` stays quick: no finite elements, no plotting."""
    code = (
        "import sys; from fsci.cli import execute; execute(['check', sys.argv[1]]);"
        "print(sorted({'dolfinx', 'petsc4py', 'mpi4py', 'pyvista', 'gmsh', 'meshio', 'h5py'} & sys.modules.keys()))"
    )
    result = subprocess.run([sys.executable, "-c", code, case], capture_output=True, text=True, env=os.environ)
    assert result.stdout.splitlines()[-1] == "[]"
