"""The start of runs of mutated cases: each ends with results or with a message; thousands by tests/run_fuzz.py."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from programs import ENVIRONMENT
from run_fuzz import trouble

from fsci.stress.mutants import KINDS, cases, mutant

PROGRAM = Path(__file__).parents[1] / "run_fuzz.py"


@pytest.mark.parametrize("kind", KINDS)
def test_cases_without_mutations(kind, tmp_path):
    assert trouble(json.dumps(cases()[kind]), tmp_path) == ""


def test_mutants_are_the_same_every_time():
    assert [mutant(seed) for seed in range(20)] == [mutant(seed) for seed in range(20)]


def test_failures_are_reported(tmp_path, monkeypatch):
    monkeypatch.setattr("fsci.running.run.run_case", lambda *arguments, **more: print("Traceback") or 1)
    assert "Traceback" in trouble(json.dumps(cases()["beam"]), tmp_path)


@pytest.mark.slow
def test_start_of_runs():
    """A process of its own: one that hangs or dies is seen, with the seed it was at."""
    command = [sys.executable, str(PROGRAM), "0", "60"]
    done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, timeout=300)
    assert done.stdout == ""
    assert done.returncode == 0, done.stderr[-2000:]
