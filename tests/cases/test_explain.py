"""`fsci explain`: a step that fails is named with place, residuals and remedies, and can be computed alone."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from advised import require_explained
from programs import fsci
from small_cases import PLATE

from fsci.case import load_case
from fsci.case.solver import Newton
from fsci.explain import advice
from fsci.explain.place import Nearest, describe
from fsci.explain.residuals import convergence_of, curve
from fsci.plot.picture import plot_run
from fsci.report.report import read_summary, report
from solvers.api import FailureKind

#: steps that have a solution until half the time is over, and one whose load turns elements inside out
HEAVY = PLATE.replace('"1e-6*t"', '"where(t > 0.5, -50, 0.01*t)"').replace("time: {", "time: {retry: {halvings: 1}, ")


@pytest.fixture(scope="module")
def failed(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("heavy")
    (folder / "case.yaml").write_text("title: a plate\n" + HEAVY)
    done = fsci("run", folder, "-o", folder / "out")
    assert done.returncode == 1, done.stdout + done.stderr
    return folder / "out"


def test_a_failed_step(failed):
    done = fsci("explain", failed)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    what = json.loads((failed / "failure" / "failure.json").read_text())
    assert lines[0] == "a plate: failed"
    assert "steps          3, 1 repeated; " in lines[1]
    assert "failed step    4, from time 0.5 with dt 0.1" in lines
    assert "field          structure" in lines
    assert f"reason         {what['reason']}, at iteration {what['iteration']}" in lines
    assert any(line.startswith("nearest node   ") and "of plate, in its cell " in line for line in lines)
    require_explained(failed, FailureKind.INVERTED)
    assert lines[-1] == f"to compute the step alone: fsci explain {failed} --replay FOLDER"


def test_the_report_explains_it(failed):
    text = report(failed, read_summary(failed), [])
    assert "<h2>Why it failed</h2>" in text
    assert "failed step    4, from time 0.5 with dt 0.1" in text


def test_the_failed_step_alone(failed, tmp_path):
    """It fails in the same way, with the same residuals; with a load that is as before it does not."""
    what = json.loads((failed / "failure" / "failure.json").read_text())
    done = fsci("explain", failed, "--replay", tmp_path / "alone")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1].endswith(f"fsci resume {tmp_path / 'alone'}")
    assert fsci("resume", tmp_path / "alone").returncode == 1
    again = json.loads((tmp_path / "alone" / "failure" / "failure.json").read_text())
    assert json.dumps(again) == json.dumps(what), "nan is not equal to itself"
    case = load_case(tmp_path / "alone")
    assert (case.time.step, case.time.end) == (what["dt"], what["time"] + what["dt"])
    text = (tmp_path / "alone" / "case.yaml").read_text()
    (tmp_path / "alone" / "case.yaml").write_text(text.replace("-50", "0.005"))
    assert fsci("resume", tmp_path / "alone").returncode == 0
    assert fsci("explain", failed, "--replay", tmp_path / "alone").returncode == 2, "a folder that exists stays"


def test_a_run_that_did_not_fail(tmp_path):
    (tmp_path / "case.yaml").write_text("title: a plate\n" + PLATE)
    assert fsci("run", tmp_path, "-o", tmp_path / "out").returncode == 0
    lines = fsci("explain", tmp_path / "out").stdout.splitlines()
    assert lines[0] == "a plate: finished"
    assert sum(line.startswith("slow step ") for line in lines) == 3
    done = fsci("explain", tmp_path / "out", "--replay", tmp_path / "alone")
    assert (done.returncode, done.stderr) == (2, "fsci explain: there is no failed step to replay\n")
    done = fsci("explain", tmp_path)
    assert done.stderr == f"fsci explain: '{tmp_path}' has no summary.json: no run has ended there\n"


@pytest.mark.parametrize(
    ("residuals", "kind"),
    [
        ((), "none"),
        ((1.0, math.nan), "not finite"),
        ((1.0, 1e-2, 1e-4, 1e-8), "converges"),
        ((1.0, 0.5, 2.0, 40.0), "diverges"),
        ((1.0, 1e-3, 9.9e-4, 9.8e-4, 9.9e-4, 9.85e-4, 9.84e-4), "stagnates"),
        ((1.0, 0.5, 1.1, 0.4, 1.2, 0.5, 1.0), "oscillates"),
        ((20.0, 0.04, 0.01, 0.06, 0.01, 0.005, 0.2), "oscillates"),  # far below what it began with
        ((1.0, 10.0, 5.0, 100.0, 20.0, 1000.0), "diverges"),
    ],
)
def test_courses(residuals, kind):
    assert convergence_of(residuals).kind == kind


def test_iterations_that_are_missing():
    """Residuals 1, 1/2, 1/4, 1/8 need 10 more iterations to 1e-4: 2^-13 is the first below."""
    found = convergence_of((1.0, 0.5, 0.25, 0.125))
    assert found.rate == pytest.approx(0.5)
    assert found.remaining(0.125, 1.1e-4) == math.ceil(math.log(1.1e-4 / 0.125) / math.log(0.5)) == 11
    assert convergence_of((1.0, 30.0)).remaining(30.0, 1.0) is None


def test_the_curve_is_logarithmic():
    lengths = [line.count("#") for line in curve((1.0, 1e-2, 1e-4))]
    assert lengths in ([40, 20, 1], [40, 21, 1])
    assert curve((1.0, math.nan))[1].split() == ["1", "nan", "#"]


def test_what_to_try():
    newton = Newton()
    for residuals, words in (
        ((1.0, 0.5, 0.25, 0.125), ["solver.newton.max_iterations=49: at this rate it takes 24 iterations more"]),
        ((1.0, 0.8), []),
        (
            (5.53e-7, 5.57e-7),
            ["solver.newton.max_iterations=25: a step of a nonlinear problem takes several iterations"],
        ),
    ):
        assert list(advice.of_failure(FailureKind.NEWTON, residuals, newton)) == words
        coupling = list(advice.of_failure(FailureKind.COUPLING, residuals, newton))
        assert coupling == list(advice.OF_KIND[FailureKind.COUPLING]), "its residuals are not those of Newton's method"
    run = {
        "steps": {"accepted": 10, "retried": 3},
        "newton": {"total": 100},
        "wall": {"total": 10.0, "output": 3.0, "solve": 6.5, "start": 0.1},
        "processes": 1,
    }
    assert [text.split(":")[0] for text in advice.of_run(run)] == [
        "a smaller time.step",
        "a smaller time.step",
        "output.fields_every=10",
        "mpirun -n 2",
    ]


def test_rounding_errors_are_zero(tmp_path):
    (tmp_path / "case.yaml").write_text("title: a plate\n" + PLATE)
    case = load_case(tmp_path)
    values = {"velocity": np.array([0.5, -3e-18, 1e-6])}
    there = describe(Nearest("plate", 7, 3, 3.42e-18, 1.0, values), case)
    assert there[:2] == ["nearest node   7 of plate, in its cell 3, at this place", "  velocity          0.5, 0, 1e-06"]
    beside = describe(Nearest("plate", 7, 3, 3.42e-3, 1.0, values), case)
    assert beside[0] == "nearest node   7 of plate, in its cell 3, 0.00342 m away"
    (tmp_path / "case.yaml").write_text("units: {length: mm}\n" + PLATE)
    beside = describe(Nearest("plate", 7, 3, 3.42e-3, 1.0, values), load_case(tmp_path))
    assert beside[0] == "nearest node   7 of plate, in its cell 3, 0.00342 mm away"


def test_the_iterate_that_failed_is_drawn(failed):
    drawn = [path.name for path in plot_run(failed)]
    assert "failed_displacement.png" in drawn
    assert "final_displacement.png" in drawn


def test_a_run_without_an_accepted_step_is_drawn(tmp_path):
    """It has no curves, and no picture of a displacement that is zero everywhere."""
    (tmp_path / "case.yaml").write_text("title: a plate\n" + PLATE)
    settings = ("solver.newton.max_iterations=1", "time.retry.halvings=0")
    done = fsci("run", tmp_path, "-o", tmp_path / "out", *(word for text in settings for word in ("--set", text)))
    assert done.returncode == 1, done.stdout + done.stderr
    assert [path.name for path in plot_run(tmp_path / "out")] == ["failed_displacement.png", "mesh.png"]


def test_a_failure_of_another_version(failed, tmp_path):
    shutil.copytree(failed, tmp_path / "out")
    path = tmp_path / "out" / "failure" / "failure.json"
    text = path.read_text()
    for kind in ("", '"kind": "of late",'):
        path.write_text(text.replace('"kind": "inverted",', kind))
        done = fsci("explain", tmp_path / "out")
        words = "fsci explain: another version of fsci wrote failure.json: run the case again\n"
        assert (done.returncode, done.stderr) == (2, words)
