"""Runs of the program as users start them, to their end, a signal, or a time limit."""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsci.running.child import command, environment
from fsci.running.history import History, read_history

NEVER_ENDED = -1000  #: code of a run that was given up
PATIENCE = 600.0  #: [s] until then; draws take seconds alone on a core, but a busy machine must not look like a hang


@dataclass(frozen=True)
class Ended:
    """The end of a run: exit code, output and results."""

    code: int
    words: str  #: its output
    history: History
    summary: Mapping[str, Any]

    @property
    def message(self) -> str:
        """The reason of a failure: its last message, or the first problem of its case."""
        if self.code == NEVER_ENDED:
            return "it did not end"
        if message := self.summary.get("message"):
            return str(message)
        lines = [line for line in self.words.splitlines() if line.strip() and not line.startswith("warning")]
        return (lines[0] if self.code == 2 else lines[-1]) if lines else ""


def run(folder: Path, case: Mapping[str, Any], *, processes: int = 1, patience: float = PATIENCE) -> Ended:
    """Write a case into a folder and compute it; results in its folder out."""
    write(folder, case)
    return _ended(folder, command("run", str(folder), "-o", str(folder / "out"), processes=processes), patience)


def run_text(folder: Path, text: str, *arguments: str, patience: float = PATIENCE) -> Ended:
    """Compute a case file with any content."""
    (folder / "case.yaml").write_text(text)
    return _ended(folder, command("run", str(folder), "-o", str(folder / "out"), *arguments), patience)


def run_killed(folder: Path, case: Mapping[str, Any], *, steps: int, delay: float, patience: float = PATIENCE) -> Ended:
    """Compute a case, kill it some seconds after it has done some steps, and resume it."""
    write(folder, case)
    arguments = command("run", str(folder), "-o", str(folder / "out"))
    with (folder / "words.txt").open("w") as words:
        process = subprocess.Popen(arguments, stdout=words, stderr=words, env=environment())
    end = time.monotonic() + patience
    while process.poll() is None and steps_done(folder) < steps and time.monotonic() < end:
        time.sleep(0.005)
    time.sleep(delay)
    process.kill()
    process.wait()
    return _ended(folder, command("resume", str(folder / "out")), patience)


def write(folder: Path, case: Mapping[str, Any]) -> None:
    """The case file of a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "case.yaml").write_text(json.dumps(case, indent=1))


def steps_done(folder: Path) -> int:
    """Steps that a run has written so far."""
    path = folder / "out" / "history.csv"
    return path.read_bytes().count(b"\n") - 1 if path.exists() else 0


def _ended(folder: Path, arguments: list[str], patience: float) -> Ended:
    try:
        done = subprocess.run(arguments, capture_output=True, text=True, env=environment(), timeout=patience)
    except subprocess.TimeoutExpired as late:
        said = (late.stdout or b"") + (late.stderr or b"")
        return Ended(NEVER_ENDED, said.decode(errors="replace") if isinstance(said, bytes) else str(said), {}, {})
    history, summary = folder / "out" / "history.csv", folder / "out" / "summary.json"
    return Ended(
        done.returncode,
        done.stdout + done.stderr,
        read_history(history) if history.exists() else {},
        json.loads(summary.read_text()) if summary.exists() else {},
    )
