"""summary.json: settings, cost and results of a run."""

from __future__ import annotations

import json
import math
import platform
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fsci.running.files import write_text
from fsci.running.history import History
from solvers.api import Finding, State, StepInfo
from solvers.timing import Timer

if TYPE_CHECKING:
    from fsci.resolution.words import Resolved

#: Columns of the history with the iterations of linear solvers in a step.
LINEAR_COLUMNS = ("coupling.linear", "fluid.linear")


@dataclass
class Warned:
    """What a sentinel has found: the time of its first message [s], and the largest value since."""

    time: float
    value: float
    message: str


@dataclass
class RunRecord:
    """Data of a run that the history does not have: retries, residuals of recorded steps, time by part."""

    residual_steps: Collection[int] = ()  #: steps whose residuals summary.json keeps
    residuals: dict[int, list[float]] = field(default_factory=dict)  #: step -> residual norms, first to last
    retried: int = 0  #: attempts that failed and were repeated with a smaller step
    warnings: dict[tuple[str, str], Warned] = field(default_factory=dict)  #: by kind and body
    resolution: dict[str, dict[str, Any]] = field(default_factory=dict)  #: by body, or body and what a gap is to
    timer: Timer = field(default_factory=Timer)
    begin: float = field(default_factory=time.perf_counter)
    earlier: float = 0.0  #: wall time of the run before it was resumed [s]

    def accept(self, step: int, info: StepInfo) -> None:
        """Notes an accepted step."""
        if step in self.residual_steps:
            self.residuals[step] = [float(norm) for norm in info.residuals]

    def retry(self) -> None:
        """Notes a failed attempt."""
        self.retried += 1

    def warn(self, time: float, findings: Sequence[Finding]) -> list[Finding]:
        """Notes findings; returns those of a kind and body that were not found before."""
        new = []
        for finding in findings:
            known = self.warnings.get((finding.kind, finding.body))
            if known is None:
                self.warnings[finding.kind, finding.body] = Warned(time, finding.value, finding.message)
                new.append(finding)
            else:
                known.value = max(known.value, finding.value, key=abs)
        return new

    def warned(self) -> list[dict[str, Any]]:
        """The warnings as plain data."""
        return [{"kind": kind, "body": body, **vars(known)} for (kind, body), known in self.warnings.items()]

    def note_resolution(self, found: Sequence[Resolved]) -> None:
        """Keeps the last flow around each body, and of each narrow gap the one with the largest error."""
        for one in found:
            name = f"{one.body}|{one.to}"
            if not one.to or one.error >= self.resolution.get(name, {}).get("error", 0.0):
                self.resolution[name] = one.plain()

    def wall(self) -> float:
        """Wall time since the run began [s], without the pauses between stop and resume."""
        return self.earlier + time.perf_counter() - self.begin

    def save(self) -> State:
        """The record in a checkpoint, so that the summary of a resumed run covers the whole run."""
        return {
            "retried": self.retried,
            "residuals": {str(step): norms for step, norms in self.residuals.items()},
            "warnings": [[kind, body, *vars(known).values()] for (kind, body), known in self.warnings.items()],
            "resolution": self.resolution,
            "seconds": dict(self.timer.seconds),
            "wall": self.wall(),
        }

    def restore(self, state: State) -> None:
        """Inverse of save."""
        self.retried = state["retried"]
        self.residuals = {int(step): norms for step, norms in state["residuals"].items()}
        self.warnings = {(kind, body): Warned(*known) for kind, body, *known in state["warnings"]}
        self.resolution = state["resolution"]
        now = self.timer.seconds
        self.timer.seconds = {
            name: now.get(name, 0.0) + state["seconds"].get(name, 0.0) for name in state["seconds"] | now
        }
        self.earlier = state["wall"]


def summarize(
    record: RunRecord,
    history: History,
    *,
    status: str,
    title: str,
    processes: int,
    dofs: Mapping[str, int],
    memory: float,
    probes: Sequence[str] = (),
    balances: Sequence[str] = (),
    verify: Sequence[Mapping[str, Any]] = (),
    units: Mapping[str, str] | None = None,
    message: str = "",
    imbalance: Mapping[str, float] | None = None,
) -> dict[str, Any]:
    """The content of summary.json.

    `status` is finished, stopped or failed and `message` says why; `memory` is the peak of the largest
    process [MB]; `probes` and `balances` are history columns; `units` are those of length, mass and time; `imbalance`:
    work of contact on the busiest process over the mean.
    """
    iterations = [int(count) for count in history.get("iterations", ())]
    columns = {name: history[name] for name in (*probes, *balances) if len(history.get(name, ()))}
    return {
        "title": title,
        "status": status,
        "message": message,
        "processes": processes,
        "versions": versions(),
        "dofs": dict(dofs),
        "steps": {"accepted": len(iterations), "retried": record.retried},
        "newton": {
            "total": sum(iterations),
            "max": max(iterations, default=0),
            "per_step": iterations,
            "residuals": {str(step): norms for step, norms in sorted(record.residuals.items())},
        },
        "linear": _linear(history),
        "wall": {"total": record.wall(), **record.timer.seconds},
        "memory_mb": memory,
        "probes": {
            name: {"final": values[-1], "min": _of_numbers(np.min, values), "max": _of_numbers(np.max, values)}
            for name, values in columns.items()
            if name in probes
        },
        "balances": {
            name: {"final": values[-1], "max_abs": _of_numbers(np.max, np.abs(values))}
            for name, values in columns.items()
            if name in balances
        },
        "warnings": record.warned(),
        "resolution": list(record.resolution.values()),
        "verify": [dict(result) for result in verify],
        "units": dict(units or {}),
        **({"contact": {"imbalance": dict(imbalance)}} if imbalance else {}),
    }


def _linear(history: History) -> dict[str, int]:
    """Iterations of the linear solvers of flow and coupling: in total, and the most in a step; empty without a flow."""
    for name in LINEAR_COLUMNS:
        if len(values := history.get(name, ())):
            return {"total": int(np.sum(values)), "max": int(np.max(values))}
    return {}


def _of_numbers(statistic: Callable[[Any], float], values: NDArray[np.float64]) -> float:
    """A statistic of the steps that have a value: a probe that was added later has none in earlier ones."""
    known = values[~np.isnan(values)]
    return float(statistic(known)) if len(known) else math.nan


def shares(total: float, parts: Mapping[str, float]) -> str:
    """Time of a run by part: "solve 40 %, assembly 35 %, other 25 %", the largest first, from 1 % on."""
    percent = {name: round(100 * seconds / total) for name, seconds in parts.items()} if total else {}
    percent = {name: share for name, share in sorted(percent.items(), key=lambda part: -part[1]) if share}
    rest = max(100 - sum(percent.values()), 0)
    return ", ".join(f"{name} {share} %" for name, share in [*percent.items(), ("other", rest)])


def write_summary(path: Path, data: Mapping[str, Any]) -> None:
    """Writes JSON, whole or not at all; numbers that are not finite become null."""
    write_text(path, json.dumps(plain(data), indent=2, allow_nan=False) + "\n")


def plain(value: Any) -> Any:
    """A value in the types of JSON."""
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def memory_mb() -> float:
    """Peak resident set of this process [MB]; getrusage would count that of the parent, too, until it called exec."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:")) / 1024


def versions() -> dict[str, str]:
    """Versions of the program and of the libraries that affect its results."""
    from importlib import metadata

    from petsc4py import PETSc

    found = {"python": platform.python_version(), "petsc": ".".join(map(str, PETSc.Sys.getVersion()))}
    for name, package in {"fsci": "fsci", "dolfinx": "fenics-dolfinx", "numpy": "numpy"}.items():
        try:
            found[name] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[name] = "unknown"
    return found
