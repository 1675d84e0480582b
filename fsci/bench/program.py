"""Runs of the program in separate processes, with time, memory and results from their summary."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from typing import Any


class ProgramFailed(RuntimeError):
    """A run that did not come to its end."""


def run_case(case: Path, out: Path, settings: Mapping[str, Any]) -> dict[str, Any]:
    """summary.json of a run with some settings replaced (dotted names), without `verify`."""
    return run_timed(case, out, {"verify": [], **settings})[0]


def run_timed(case: Path, out: Path, settings: Mapping[str, Any]) -> tuple[dict[str, Any], float]:
    """(summary.json, seconds of the processor) of a run that may miss its reference values.

    Raises ProgramFailed if it does not come to its end.
    """
    arguments = [f"--set={name}={json.dumps(value)}" for name, value in settings.items()]
    command = [sys.executable, "-m", "fsci", "run", str(case), "-o", str(out), "--force", *arguments]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    begin = _seconds()
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    seconds = _seconds() - begin
    summary = json.loads((out / "summary.json").read_text()) if (out / "summary.json").exists() else {}
    if done.returncode not in (0, 1) or summary.get("status") != "finished":
        raise ProgramFailed(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
    return summary, seconds


def _seconds() -> float:
    """Processor seconds of all processes that have ended."""
    used = getrusage(RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
