"""Benchmark of the Turek-Hron flag (CSM3): time of a step by part, and error against time."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fsci.bench.program import run_case
from fsci.bench.table import Row
from fsci.run.history import read_history
from fsci.run.verify import amplitude, frequency

CASE = Path(__file__).parents[2] / "cases" / "csm3"
REFINE = "structure.bodies.flag.mesh.parameters.refine"

#: (mesh, step [s]) of the accuracy table, the most accurate last
RUNS = ((1, 0.02), (1, 0.01), (1, 0.005), (1, 0.0025), (2, 0.01), (2, 0.005), (2, 0.0025), (4, 0.005), (4, 0.0025))


def run_steps() -> list[Row]:
    """Milliseconds per step by part."""
    with TemporaryDirectory() as folder:
        return [step(refine, Path(folder)) for refine in (1, 2, 4)]


def step(refine: int, out: Path) -> Row:
    settings = {REFINE: refine, "time.end": 1.0}
    summary = run_case(CASE, out, settings)
    steps, wall = summary["steps"]["accepted"], summary["wall"]
    parts = {name: 1e3 * wall[name] / steps for name in ("assembly", "solve", "probes", "output", "checkpoint")}
    total = 1e3 * (wall["total"] - wall["start"]) / steps
    return {
        "cells": f"{35 * refine} x {2 * refine}",
        "dofs": summary["dofs"]["structure"],
        "newton per step": summary["newton"]["total"] / steps,
        "step [ms]": total,
        **parts,
        "rest": total - sum(parts.values()),
        "memory [MB]": round(summary["memory_mb"]),
    }


def run_accuracy() -> list[Row]:
    """Two seconds: deviation of A.y from the most accurate run, relative to the amplitude, against wall time."""
    with TemporaryDirectory() as folder:
        found = [(refine, dt, *swing(refine, dt, Path(folder))) for refine, dt in RUNS]
    finest = found[-1][3]
    return [row(refine, dt, summary, history, finest) for refine, dt, summary, history in found]


def swing(refine: int, dt: float, out: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    settings = {REFINE: refine, "time.step": dt, "time.end": 2.0, "output.fields_every": 0}
    return run_case(CASE, out, settings), read_history(out / "history.csv")


def row(refine: int, dt: float, summary: dict[str, Any], history: dict[str, Any], finest: dict[str, Any]) -> Row:
    time, tip = history["time"], history["A.y"]
    reference = finest["A.y"][np.searchsorted(finest["time"], time - 1e-9)]
    return {
        "cells": f"{35 * refine} x {2 * refine}",
        "step [s]": dt,
        "wall [s]": summary["wall"]["total"],
        "newton": summary["newton"]["total"],
        "deviation [%]": 100.0 * float(np.abs(tip - reference).max()) / amplitude(time, tip),
        "frequency [Hz]": f"{frequency(time, tip):.4f}",
        "amplitude [mm]": f"{1e3 * amplitude(time, tip):.3f}",
        "energy error": float(np.abs(history["structure.energy"]).max() / history["energy.internal"].max()),
    }
