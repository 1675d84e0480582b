"""Our numbers and those of other programs for one problem, side by side. One process, one thread, processor time."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from time import process_time
from typing import Any

import numpy as np

from fsci.bench import fluid, hertz
from fsci.bench.peers import fsi1, fsi1_files, hertz_files, stokes
from fsci.bench.peers.install import calculix, python_of
from fsci.bench.table import Row

HERE = Path(__file__).parent
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
ONLY_OURS = ("element", "cells of D", "start [s]", "solve [s]")
ERRORS = "largest error [%]"
CALCULIX_TO = 4  #: cells per radius of contact; with 8 its first iteration turns cells inside out
PATIENCE = 600.0  #: [s] of a program for one problem


class PeerFailed(Exception):
    """A program did not solve a problem."""


def run_stokes(folder: Path) -> list[Row]:
    """Stokes flow around a cut disc with an exact solution, first and second order."""
    python = python_of("ngsxfem", folder)
    rows = [
        _row(f"fsci {element}", stokes.solve(element, n)) for element in ("q1q1", "q2q1") for n in (20, 40, 80, 160)
    ]
    for order, name in ((1, "ngsxfem P1-P1"), (2, "ngsxfem P2-P1")):
        script = HERE / "ngsxfem_stokes.py"
        rows += [_row(name, _script(python, script, str(order), str(n))) for n in (20, 40, 80, 160)]
    return rows


def run_cylinder(folder: Path) -> list[Row]:
    """Schaefer-Turek 2D-1 with a cut cylinder: largest error of drag, lift and pressure difference."""
    python = python_of("ngsxfem", folder)
    rows = []
    for element, cells in fluid.STEADY_RUNS:
        begin = process_time()
        found = fluid.steady(element, cells)
        rows.append(_row(f"fsci {element}", _with_largest({**found, "time [s]": process_time() - begin})))
    for size in (0.01, 0.007, 0.005, 0.0035):
        rows.append(_row("ngsxfem P2-P1", _with_largest(_script(python, HERE / "ngsxfem_cylinder.py", str(size)))))
    return rows


def run_hertz(folder: Path) -> list[Row]:
    """A ball pressed onto a plane in one step: errors of the pressure at nodes."""
    python, ccx = python_of("kratos", folder), calculix()
    rows = []
    for per_radius, outer in ((2, 6), (4, 9), (8, 14)):
        found = hertz.solve(per_radius, outer)
        values = {"dofs": found.structure.dofs(), "newton": found.newton, "time [s]": found.cpu, "force": found.force}
        rows.append(_row("fsci", pressure_errors({**values, "distance": found.distance, "pressure": found.pressure})))
        mesh = folder / f"ball_{per_radius}.mdpa"
        hertz_files.write_kratos(mesh, per_radius, outer)
        peer = _script(python, HERE / "kratos_hertz.py", str(mesh), str(hertz.PRESS))
        rows.append(_row("Kratos, ALM mortar", pressure_errors({**peer, "distance": np.hypot(*np.array(peer["x"]).T)})))
        if per_radius <= CALCULIX_TO:
            rows.append(_row("CalculiX, penalty", pressure_errors(_by_calculix(ccx, folder, per_radius, outer))))
    return rows


def run_fsi1(folder: Path) -> list[Row]:
    """Turek-Hron FSI1: largest error of the flag's tip, drag and lift."""
    python = python_of("kratos", folder)
    rows = [_row("fsci q2q1, IQN-ILS", _with_largest(fsi1.solve(scale))) for scale in (0.5, 0.7, 1.0)]
    for cells, largest in ((20, 0.05), (35, 0.03), (70, 0.02), (100, 0.014)):
        flag, mesh = folder / f"flag_{cells}.mdpa", fsi1_files.flag(cells)
        fluid = folder / f"fluid_{cells}.mdpa"
        fsi1_files.write_flag(flag, mesh)
        fsi1_files.write_fluid(fluid, mesh.points[fsi1_files.along(mesh)], largest)
        peer = _script(python, HERE / "kratos_fsi1.py", str(fluid), str(flag))
        rows.append(_row("Kratos, fitted, MVQN", _with_largest(peer)))
    return rows


ROWS: dict[str, Callable[[Path], list[Row]]] = {
    "stokes": run_stokes,
    "cylinder": run_cylinder,
    "hertz": run_hertz,
    "fsi1": run_fsi1,
}


def _row(program: str, found: dict[str, Any]) -> Row:
    return {"program": program, **{name: value for name, value in found.items() if name not in ONLY_OURS}}


def _with_largest(found: dict[str, Any]) -> dict[str, Any]:
    errors = {name: value for name, value in found.items() if name.endswith("error [%]")}
    rest = {name: value for name, value in found.items() if name not in errors}
    return {**rest, **errors, ERRORS: max(map(abs, errors.values()))}


def pressure_errors(found: dict[str, Any]) -> dict[str, Any]:
    """Errors of the pressure by Hertz' solution for the force found; nodes of the core have equal areas nearly."""
    radius = (0.75 * found["force"] * hertz.RADIUS * (1.0 - hertz.NU**2) / hertz.E) ** (1.0 / 3.0)
    peak = 1.5 * found["force"] / (np.pi * radius**2)
    distance, pressure = np.asarray(found["distance"]), np.asarray(found["pressure"])
    core = distance < hertz.CORE
    exact = peak * np.sqrt(np.maximum(0.0, 1.0 - (distance[core] / radius) ** 2))
    return {
        **{name: found[name] for name in ("dofs", "newton", "time [s]", "force")},
        "peak [%]": 100.0 * (pressure.max() / peak - 1.0),
        "pressure [%]": 100.0 * float(np.linalg.norm(pressure[core] - exact) / np.linalg.norm(exact)),
    }


def _script(python: Path, script: Path, *arguments: str) -> dict[str, Any]:
    """The row that a script prints. Raises PeerFailed."""
    words = run_program(python.parents[2], str(python), str(script), *arguments)
    return json.loads([line for line in words.splitlines() if line.startswith("{")][-1])


def run_program(folder: Path, *command: str) -> str:
    environment = {**os.environ, **ONE_THREAD}
    try:
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        raise PeerFailed(f"{command[0]} took more than {PATIENCE:g} s") from None
    if done.returncode:
        raise PeerFailed(f"{' '.join(command)}:\n{(done.stdout + done.stderr)[-1000:]}")
    return done.stdout


def _by_calculix(ccx: str, folder: Path, per_radius: int, outer: int) -> dict[str, Any]:
    """Its time is that of the whole program, which reads a small file."""
    job = folder / f"ball_{per_radius}"
    hertz_files.write_calculix(job.with_suffix(".inp"), per_radius, outer)
    before = _seconds()
    words = run_program(folder, ccx, job.name)
    seconds = _seconds() - before
    force = float(job.with_suffix(".dat").read_text().split()[-1])
    ball, _, points, _, sets = hertz_files.both(per_radius, outer)
    pressure = contact_pressure(job.with_suffix(".frd"))
    return {
        "dofs": 3 * len(points),
        "newton": words.count(" iteration "),
        "time [s]": seconds,
        "force": 4.0 * abs(force),
        "distance": np.linalg.norm(ball.points[sets["bottom"], :2], axis=1),
        "pressure": [pressure.get(node + 1, 0.0) for node in sets["bottom"]],
    }


def contact_pressure(path: Path) -> dict[int, float]:
    """Pressure of contact by number of node, of CalculiX' result file: its columns are 12 wide."""
    found, wanted = {}, False
    for line in path.read_text().splitlines():
        if line.startswith(" -4"):
            wanted = line.split()[1] == "CONTACT"
        elif line.startswith(" -1") and wanted:
            found[int(line[3:13])] = float(line[13 + 3 * 12 : 13 + 4 * 12])
        elif line.startswith(" -3"):
            wanted = False
    return found


def _seconds() -> float:
    used = getrusage(RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
