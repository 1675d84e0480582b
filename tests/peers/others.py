"""The scenes of the peers by other programs: their input is written, they are run, their rows are read."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from typing import Any

import fsi1_files
import hertz_files
import numpy as np
from install import calculix, python_of
from ours import with_largest
from pressure import pressure_errors

from fsci.bench.hertz import PRESS
from fsci.bench.table import Row

HERE = Path(__file__).parent
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
PATIENCE = 600.0  #: [s] of a program for one problem


class PeerFailed(Exception):
    """A program did not solve a problem."""


def stokes(order: int, cells: int, folder: Path) -> Row:
    """By ngsxfem."""
    return _script(python_of("ngsxfem", folder), "ngsxfem_stokes.py", order, cells)


def cylinder(size: float, folder: Path) -> Row:
    """By ngsxfem."""
    return with_largest(_script(python_of("ngsxfem", folder), "ngsxfem_cylinder.py", size))


def ball_of_kratos(per_radius: int, outer: int, folder: Path) -> Row:
    """By augmented Lagrange multipliers."""
    python, mesh = python_of("kratos", folder), folder / f"ball_{per_radius}.mdpa"
    hertz_files.write_kratos(mesh, per_radius, outer)
    found = _script(python, "kratos_hertz.py", mesh, PRESS)
    return pressure_errors({**found, "distance": np.hypot(*np.array(found["x"]).T)})


def ball_of_calculix(per_radius: int, outer: int, folder: Path) -> Row:
    """By a penalty. The time is that of the whole program, which reads a small file."""
    job, program = folder / f"ball_{per_radius}", calculix()
    hertz_files.write_calculix(job.with_suffix(".inp"), per_radius, outer)
    before = _seconds()
    words = run_program(folder, program, job.name)
    seconds = _seconds() - before
    force = float(job.with_suffix(".dat").read_text().split()[-1])
    ball, _, points, _, sets = hertz_files.both(per_radius, outer)
    pressure = contact_pressure(job.with_suffix(".frd"))
    return pressure_errors(
        {
            "dofs": 3 * len(points),
            "newton": words.count(" iteration "),
            "time [s]": seconds,
            "force": 4.0 * abs(force),
            "distance": np.linalg.norm(ball.points[sets["bottom"], :2], axis=1),
            "pressure": [pressure.get(node + 1, 0.0) for node in sets["bottom"]],
        }
    )


def flag(cells: int, largest: float, folder: Path) -> Row:
    """By Kratos on fitted meshes."""
    python, mesh = python_of("kratos", folder), fsi1_files.flag(cells)
    flag, fluid = folder / f"flag_{cells}.mdpa", folder / f"fluid_{cells}.mdpa"
    fsi1_files.write_flag(flag, mesh)
    fsi1_files.write_fluid(fluid, mesh.points[fsi1_files.along(mesh)], largest)
    return with_largest(_script(python, "kratos_fsi1.py", fluid, flag))


def _script(python: Path, script: str, *arguments: Any) -> dict[str, Any]:
    """The row that a script of this folder prints. Raises PeerFailed."""
    words = run_program(python.parents[2], str(python), str(HERE / script), *map(str, arguments))
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
