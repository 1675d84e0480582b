"""Running the program as a user does, on one process or several."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

ENVIRONMENT = {
    **os.environ,
    "OPENBLAS_NUM_THREADS": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",  # the same for Open MPI 5
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
}


#: for mpirun: processes that wait give their core to others
PARALLEL = {**ENVIRONMENT, "OMPI_MCA_mpi_yield_when_idle": "1"}


def command(*arguments, processes: int = 1) -> list[str]:
    launcher = ["mpirun", "-n", str(processes)] if processes > 1 else []
    return [*launcher, sys.executable, "-m", "fsci", *map(str, arguments)]


def fsci(*arguments, processes: int = 1, timeout: float = 600.0) -> subprocess.CompletedProcess[str]:
    """Run `fsci` to its end."""
    environment = PARALLEL if processes > 1 else ENVIRONMENT
    return subprocess.run(
        command(*arguments, processes=processes), capture_output=True, text=True, env=environment, timeout=timeout
    )


def run_whole(name: str, folder, *changes: str, processes: int = 1, timeout: float = 1200.0) -> str:
    """Run a case to its end, without fields; returns its output. It verifies all numbers, and sentinels are silent."""
    words = [word for change in ("output.fields_every=0", *changes) for word in ("--set", change)]
    run = fsci("run", f"cases/{name}", "-o", folder, *words, processes=processes, timeout=timeout)
    assert run.returncode == 0, run.stdout[-3000:]
    assert "verify ok" in run.stdout
    assert "MISSED" not in run.stdout
    assert warnings_of(folder) == []
    return run.stdout


def warnings_of(out) -> list[dict]:
    """What the sentinels of a run have found."""
    found: list[dict] = json.loads((Path(out) / "summary.json").read_text())["warnings"]
    return found


def on_processes(processes: int, *program, timeout: float = 600.0) -> subprocess.CompletedProcess[str]:
    """Run a Python program of the tests by mpirun; an exception in one process ends all, instead of a wait."""
    launcher = ["mpirun", "-n", str(processes)] if processes > 1 else []
    command = [*launcher, sys.executable, "-m", "mpi4py", *map(str, program)]
    environment = {**(PARALLEL if processes > 1 else ENVIRONMENT), "PYTHONPATH": str(Path(__file__).parent)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=timeout)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def start_fsci(*arguments) -> subprocess.Popen[str]:
    """Start `fsci` and go on."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen(command(*arguments), text=True, env=ENVIRONMENT, **pipes)
