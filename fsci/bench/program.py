"""Runs of the program in a process of their own, so that memory is theirs; their summary tells what they took."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def run_case(case: Path, out: Path, settings: Mapping[str, Any]) -> dict[str, Any]:
    """summary.json of a run with some settings replaced (dotted names), without `verify`."""
    overrides = {"verify": [], **settings}
    arguments = [f"--set={name}={json.dumps(value)}" for name, value in overrides.items()]
    command = [sys.executable, "-m", "fsci", "run", str(case), "-o", str(out), *arguments]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
    return json.loads((out / "summary.json").read_text())
