"""Long runs: many steps of a small case of fluid, structure and contact, for drifts of balances, memory and speed."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fsci.running.child import command, environment
from fsci.running.history import History, read_history
from fsci.stress.mutants import cases
from fsci.stress.program import steps_done, write

STEP = 0.01

Row = dict[str, float]


def long_run(steps: int, parts: int = 10) -> list[Row]:
    """A row for each of some equal parts of the run. Raises RuntimeError if it does not come to its end."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        write(folder, {**cases()["long"], "time": {"step": STEP, "end": steps * STEP}})
        with (folder / "words.txt").open("w") as words:
            arguments = command("run", str(folder), "-o", str(folder / "out"))
            process = subprocess.Popen(arguments, stdout=words, stderr=words, env=environment())
        try:
            spent = _watch(process, folder, [steps * (i + 1) // parts for i in range(parts)])
        finally:
            process.kill()
            process.wait()
        history = read_history(folder / "out" / "history.csv")
        if len(spent) < parts or history["step"][-1] < steps:
            raise RuntimeError((folder / "words.txt").read_text()[-2000:])
    return _rows(history, spent, steps, parts)


def _watch(process: subprocess.Popen, folder: Path, marks: list[int]) -> list[tuple[int, float, float]]:
    """(steps done, processor seconds, memory [MB]) when so many steps are done."""
    found = []
    for mark in marks:
        while (done := steps_done(folder)) < mark - 1 and process.poll() is None:
            time.sleep(0.2)
        if process.poll() is not None:
            break
        found.append((done, *_usage(process.pid)))
    process.wait()
    return found


def _usage(number: int) -> tuple[float, float]:
    """Processor seconds and resident memory [MB] of a process."""
    fields = Path(f"/proc/{number}/stat").read_text().rsplit(")", 1)[1].split()
    pages = int(Path(f"/proc/{number}/statm").read_text().split()[1])
    seconds = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return seconds, pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _rows(history: History, spent: list[tuple[int, float, float]], steps: int, parts: int) -> list[Row]:
    rows: list[Row] = []
    for i, (done, seconds, memory) in enumerate(spent):
        chosen = (history["step"] > steps * i // parts) & (history["step"] <= steps * (i + 1) // parts)
        part: Mapping[str, np.ndarray] = {name: values[chosen] for name, values in history.items()}
        row: Row = {
            "up to step": float(part["step"][-1]),
            "newton per step": float(part["iterations"].mean()),
            "in contact [%]": float(100 * (part["contact.active"] > 0).mean()),
            "lowest centre": float(part["centre.y"].min()),
            "highest centre": float(part["centre.y"].max()),
            "mass": _most(part, "fluid.mass"),
            "momentum": _most(part, "interface.momentum"),
            "force": _most(part, "interface.force"),
            "energy lost": float(-part["structure.energy"][-1]),
            "memory [MB]": memory,
        }
        if i:
            before = spent[i - 1]
            row["step [ms]"] = 1000 * (seconds - before[1]) / (done - before[0])
        rows.append(row)
    return rows


def _most(part: Mapping[str, np.ndarray], name: str) -> float:
    return float(np.abs(part[name]).max())
