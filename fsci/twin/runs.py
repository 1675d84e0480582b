"""The runs of twins: each is a process of its own, as many at a time as there are cores, and none twice."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from fsci.case import Case, CaseError, load_case
from fsci.running.child import command, environment
from fsci.running.history import History, read_history
from fsci.running.kept_case import copies
from fsci.running.warm import WarmProcess
from fsci.twin.changes import Twin
from fsci.twin.grids import Settings


@dataclass(frozen=True)
class TwinEnded:
    """How the run of a twin has ended: its results, or the message that says why there are none."""

    twin: Twin
    checksum: str = ""  #: of its case and of the files that this names
    message: str = ""
    history: History = field(default_factory=dict)
    summary: Mapping[str, Any] = field(default_factory=dict)

    @property
    def seconds(self) -> float | None:
        """What it took, on the clock."""
        wall = self.summary.get("wall", {}).get("total")
        return None if wall is None else float(wall)


def known_runs(results: Path) -> dict[str, str]:
    """Checksums of all runs that are in the folder, by the file of results of a former command."""
    try:
        return dict(json.loads(results.read_text())["checksums"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def has_run(case: Case, overrides: Settings, twin: Twin, out: Path, known: Mapping[str, str]) -> bool:
    """Whether the run of a twin is in the folder, of the case as it is now."""
    try:
        checksum = _checksum(load_case(case.path, (*overrides, *twin.settings)), twin.processes)
    except CaseError:
        return False
    return _is_there(checksum, twin, out, known)


def run_all(
    case: Case, overrides: Settings, twins: Sequence[Twin], out: Path, known: Mapping[str, str], warm: WarmProcess
) -> Iterator[TwinEnded]:
    """The ends of all runs, each as soon as it is there, with results in the folders of their names in `out`.

    `overrides` are those that the case was read with. A twin whose checksum is in `known` has been run. Runs on one
    process are copies of `warm`. An exception, as KeyboardInterrupt, starts no more runs; those under way get the
    signal, too, and end by themselves.
    """
    cores = len(os.sched_getaffinity(0))
    with ThreadPoolExecutor(max(1, cores // max((twin.processes for twin in twins), default=1))) as pool:
        runs = []
        for twin in twins:
            settings = (*overrides, *twin.settings)
            try:
                checksum = _checksum(load_case(case.path, settings), twin.processes)
            except CaseError as error:
                yield TwinEnded(twin, message=str(error))
                continue
            done = _is_there(checksum, twin, out, known)
            program = _read if done else partial(_run, warm)
            runs.append(pool.submit(program, case.path, settings, twin, out / twin.name, checksum))
        try:
            for run in as_completed(runs):
                yield run.result()
        finally:
            for run in runs:
                run.cancel()


def _run(warm: WarmProcess, case: Path, settings: Settings, twin: Twin, folder: Path, checksum: str) -> TwinEnded:
    words = ["run", str(case), "-o", str(folder), *(f"--set={name}={value}" for name, value in settings)]
    if twin.processes == 1:
        ended = warm.run(*words)
    else:
        launched = command(*words, processes=twin.processes)
        ended = subprocess.run(launched, capture_output=True, text=True, env=environment())
    if not (folder / "summary.json").exists() or ended.returncode not in (0, 1):
        return TwinEnded(twin, message=(ended.stderr or ended.stdout).strip())
    return _read(case, settings, twin, folder, checksum)


def _read(case: Path, settings: Settings, twin: Twin, folder: Path, checksum: str) -> TwinEnded:
    summary = json.loads((folder / "summary.json").read_text())
    if summary["status"] != "finished":
        return TwinEnded(twin, message=str(summary["message"] or summary["status"]), summary=summary)
    return TwinEnded(twin, checksum, "", read_history(folder / "history.csv"), summary)


def _is_there(checksum: str, twin: Twin, out: Path, known: Mapping[str, str]) -> bool:
    return checksum == known.get(twin.name) and (out / twin.name / "summary.json").exists()


def _checksum(case: Case, processes: int) -> str:
    """Of the text of a case, of the files that it names, and of the number of processes."""
    found = hashlib.sha256(f"{processes}\n{case.dump()}".encode())
    for file, _ in copies(case):
        found.update(file.read_bytes())
    return found.hexdigest()
