"""summary.json against a run whose numbers are counted by hand."""

from __future__ import annotations

import json
import math
import time
from pathlib import Path

import numpy as np
import pytest

from fsci.running.summary import RunRecord, Timer, memory_mb, shares, summarize, write_summary
from solvers.api import StepInfo


def test_summary_of_three_steps(tmp_path):
    record = RunRecord(residual_steps=[2])
    for step, residuals in enumerate([(1.0, 1e-9), (5.0, 1e-3, 1e-10), (2.0, 1e-8)], start=1):
        record.accept(step, StepInfo(iterations=len(residuals), residuals=residuals))
    record.retry()
    with record.timer("solve"):
        time.sleep(0.02)
    history = {
        "step": np.array([1.0, 2, 3]),
        "iterations": np.array([2.0, 3, 2]),
        "A.y": np.array([0.5, -2.0, 1.0]),
        "mass": np.array([1e-12, -3e-12, 2e-12]),
    }
    data = summarize(
        record,
        history,
        status="finished",
        title="flag",
        processes=2,
        dofs={"structure": 100},
        memory=123.5,
        probes=["A.y"],
        balances=["mass"],
        verify=[{"name": "A.y final", "value": math.nan, "ok": np.bool_(False)}],
        units={"length": "m", "mass": "kg", "time": "s"},
    )
    write_summary(tmp_path / "summary.json", data)
    read = json.loads((tmp_path / "summary.json").read_text())
    assert read["status"] == "finished"
    assert read["steps"] == {"accepted": 3, "retried": 1}
    newton = {"total": 7, "max": 3, "per_step": [2, 3, 2], "residuals": {"2": [5.0, 1e-3, 1e-10]}}
    assert read["newton"] == newton
    assert read["probes"] == {"A.y": {"final": 1.0, "min": -2.0, "max": 1.0}}
    assert read["balances"] == {"mass": {"final": 2e-12, "max_abs": 3e-12}}
    assert read["verify"] == [{"name": "A.y final", "value": None, "ok": False}]
    assert read["dofs"] == {"structure": 100}
    assert read["memory_mb"] == 123.5
    assert 0.02 <= read["wall"]["solve"] <= read["wall"]["total"] < 10
    assert set(read["versions"]) == {"fsci", "dolfinx", "petsc", "numpy", "python"}
    assert read["versions"]["numpy"] == np.__version__
    assert not list(tmp_path.glob("*.tmp"))


def test_a_run_that_failed_in_its_first_step_has_a_summary():
    data = summarize(
        RunRecord(),
        {},
        status="failed",
        title="",
        processes=1,
        dofs={},
        memory=1.0,
        probes=["A.y"],
        message="why",
    )
    assert data["steps"] == {"accepted": 0, "retried": 0}
    assert data["probes"] == {}
    assert data["message"] == "why"


def test_a_resumed_record_goes_on_counting():
    first = RunRecord(residual_steps=[1, 2])
    first.accept(1, StepInfo(1, (3.0,)))
    first.retry()
    first.timer.seconds["solve"] = 5.0
    first.begin -= 100.0
    second = RunRecord(residual_steps=[1, 2])
    second.restore(json.loads(json.dumps(first.save())))
    second.accept(2, StepInfo(1, (4.0,)))
    assert second.residuals == {1: [3.0], 2: [4.0]}
    assert second.retried == 1
    assert second.timer.seconds == {"solve": 5.0}
    assert second.wall() == pytest.approx(100.0, abs=1.0)


def test_timer_adds_up_also_through_errors_and_nesting():
    timer = Timer()

    def fail() -> None:
        with timer("inner"):
            time.sleep(0.01)
            raise ZeroDivisionError

    with timer("outer"):
        for _ in range(2):
            with pytest.raises(ZeroDivisionError):
                fail()
    assert 0.02 <= timer.seconds["inner"] <= timer.seconds["outer"] < 1.0


def test_memory_is_the_peak_the_kernel_reports():
    status = Path("/proc/self/status").read_text()
    kilobytes = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM"))
    assert memory_mb() == pytest.approx(kilobytes / 1024, rel=0.01)


def test_where_the_time_went():
    assert shares(10.0, {"assembly": 3.0, "solve": 5.04, "output": 0.04}) == "solve 50 %, assembly 30 %, other 20 %"
    assert shares(0.0, {}) == "other 100 %"
