"""How runs end: an error of one process ends all, a signal within a long solve ends the run with a checkpoint."""

import json
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc
from programs import ENVIRONMENT, PARALLEL, fsci
from small_cases import PLATE

from fsci.running.history import read_history
from solvers.algebra import unlocked

PROGRAM = Path(__file__).parents[1] / "setups" / "disturbed_run.py"

#: one linear solve a step
CASE = f"""\
{PLATE.replace("0.2", "0.25")}\
probes: {{corner: {{quantity: displacement, at: [1, 1]}}}}
solver: {{newton: {{residual: 1e-3}}}}
"""


def disturbed(what, folder, *, rank=0, processes=1):
    """A run that goes wrong in its second step."""
    (folder / "case.yaml").write_text(CASE)
    launcher = ["mpirun", "-n", str(processes)] if processes > 1 else []
    command = [*launcher, sys.executable, PROGRAM, what, str(rank), "run", folder, "-o", folder / "out"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([str(word) for word in command], env=PARALLEL if processes > 1 else ENVIRONMENT, **pipes)


@pytest.mark.parametrize(("processes", "rank"), [(2, 0), pytest.param(3, 1, marks=pytest.mark.slow)])
def test_error_of_one_process_ends_all(tmp_path, processes, rank):
    process = disturbed("error", tmp_path, rank=rank, processes=processes)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 1, output + errors
    assert f"process {rank} of {processes} failed, and all processes end: Traceback" in errors
    assert "RuntimeError: injected error" in errors


def test_full_disk_of_one_process_is_reported_without_a_traceback(tmp_path):
    process = disturbed("disk", tmp_path, rank=0, processes=2)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 1, output + errors
    assert "process 0 of 2 failed, and all processes end: No space left on device: 'history.csv'" in errors
    assert "Traceback" not in errors


#: its mpirun kills processes before they can write
OPEN_MPI_5 = pytest.mark.skipif("Open MPI v5" in MPI.Get_library_version(), reason="SIGTERM of mpirun leaves 0.25 s")


@pytest.mark.parametrize(
    ("processes", "number"),
    [
        (1, signal.SIGTERM),
        pytest.param(2, signal.SIGTERM, marks=OPEN_MPI_5),
        pytest.param(2, signal.SIGUSR1, marks=pytest.mark.slow),
    ],
)
def test_signal_within_a_solve(tmp_path, processes, number):
    """Within 5 s there is a checkpoint of the last good step; the run goes on from it as if nothing had been."""
    out = tmp_path / "out"
    process = disturbed("sleep", tmp_path, rank=-1, processes=processes)
    while not (out / "history.csv").exists() or len(read_history(out / "history.csv").get("step", ())) < 1:
        time.sleep(0.02)
        assert process.poll() is None, process.communicate()
    time.sleep(0.3)
    begin = time.monotonic()
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert time.monotonic() - begin < 5.0
    assert "Traceback" not in errors
    assert [path.name for path in (out / "checkpoint").iterdir()] == ["checkpoint_000001.h5"]
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"] == "stopped"
    assert summary["message"] == "stopped within a step, at time 0.25; continue with fsci resume"
    if processes > 1:  # the code is mpirun's own
        return
    assert process.returncode == 3
    assert fsci("resume", out).returncode == 0
    straight = tmp_path / "straight"
    assert fsci("run", tmp_path, "-o", straight).returncode == 0
    resumed, whole = (read_history(folder / "history.csv") for folder in (out, straight))
    assert np.array_equal(resumed["corner.y"], whole["corner.y"])


def test_threads_run_during_a_solve():
    """A thread that looks at the clock all the time is not held up by a factorisation."""
    n = 22
    line = sp.diags([-1, 2, -1], [-1, 0, 1], shape=(n, n))
    A = sp.kronsum(sp.kronsum(line, line), line, format="csr")
    matrix = PETSc.Mat().createAIJ(A.shape, csr=(A.indptr, A.indices, A.data), comm=PETSc.COMM_SELF)
    b, x = matrix.createVecs()
    b.set(1.0)
    ksp = PETSc.KSP().create(PETSc.COMM_SELF)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    ksp.getPC().setType(PETSc.PC.Type.LU)
    ksp.setOperators(matrix)
    looks, done = [], threading.Event()

    def look():
        while not done.is_set():
            looks.append(time.monotonic())
            time.sleep(0.001)

    thread = threading.Thread(target=look)
    thread.start()
    begin = time.monotonic()
    unlocked.solve(ksp, b, x)
    end = time.monotonic()
    done.set()
    thread.join()
    assert np.abs(A @ x.array - 1.0).max() < 1e-10
    within = [moment for moment in looks if begin < moment < end]
    assert np.diff([begin, *within, end]).max() < 0.5 * (end - begin)


def test_errors_of_petsc_are_raised():
    ksp = PETSc.KSP().create(PETSc.COMM_SELF)
    vector = PETSc.Vec().createSeq(3, comm=PETSc.COMM_SELF)
    with pytest.raises(PETSc.Error):
        unlocked.solve(ksp, vector, vector)
