"""Running the program on one process or several."""

from __future__ import annotations

import json
import os
import runpy
import subprocess
import sys
from pathlib import Path

from standing import COUNT, StandingProcesses

from fsci.running.copied_process import exit_code, import_common, run_in_copy
from fsci.running.copied_process import fsci as fsci_here
from fsci.running.warm import WarmProcess

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

#: commands that get a process of their own: what draws may have threads here, which a copy would wait for
DRAWING = ("plot", "report", "preview")


STANDING = StandingProcesses({**PARALLEL, "PYTHONPATH": str(Path(__file__).parent)})


def command(*arguments, processes: int = 1) -> list[str]:
    launcher = ["mpirun", "-n", str(processes)] if processes > 1 else []
    return [*launcher, sys.executable, "-m", "fsci", *map(str, arguments)]


def fsci(*arguments, processes: int = 1, timeout: float = 600.0) -> subprocess.CompletedProcess[str]:
    """Run `fsci` to its end, without its start and imports: on one process in a copy of this one, on two in those that
    stand by; see `new_process`.
    """
    words = [str(word) for word in arguments]
    if words[0] in DRAWING or processes > COUNT:
        return new_process(*words, processes=processes, timeout=timeout)
    if processes == COUNT:
        return STANDING.run("fsci", words, timeout)
    import_common()
    return run_in_copy(fsci_here, words, ENVIRONMENT, timeout)


def new_process(*arguments, processes: int = 1, timeout: float = 600.0) -> subprocess.CompletedProcess[str]:
    """Run `fsci` as a user does: for what a process has from its start, such as its options of PETSc."""
    environment = PARALLEL if processes > 1 else ENVIRONMENT
    return subprocess.run(
        command(*arguments, processes=processes), capture_output=True, text=True, env=environment, timeout=timeout
    )


def run_command(words, env=None, timeout=None, **pipes) -> subprocess.CompletedProcess[str]:
    """As subprocess.run, but a run of `fsci` on one process is a copy of this one."""
    if words[:3] != command()[:3]:
        return subprocess.run(words, env=env, timeout=timeout, **pipes)
    return run_in_copy(fsci_here, words[3:], env or {}, timeout or 600.0)


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


def python_here(words) -> int:
    """Run a Python program, the first one of the words, in this process; returns its exit code."""
    sys.argv = list(words)
    return exit_code(lambda: runpy.run_path(words[0], run_name="__main__"))


class StandingWarmProcess(WarmProcess):
    """A WarmProcess that serves all tests: a copy of this process could not copy itself while its threads run."""

    def start(self) -> None:
        """Start what copies of this process will share; again if it has ended."""
        if self._process is not None and self._process.poll() is not None:
            self._control = None
        self._started()

    def __exit__(self, *error) -> None:
        """It stays, and ends with this process."""


WARM = StandingWarmProcess()


def on_processes(processes: int, *program, timeout: float = 600.0) -> subprocess.CompletedProcess[str]:
    """Run a Python program of the tests; an exception in one process ends all, instead of a wait."""
    words = [str(word) for word in program]
    if processes == 1:
        done = run_in_copy(python_here, words, ENVIRONMENT, timeout)
    elif processes == COUNT:
        done = STANDING.run(words[0], words[1:], timeout)
    else:
        command = ["mpirun", "-n", str(processes), sys.executable, "-m", "mpi4py", *words]
        environment = {**PARALLEL, "PYTHONPATH": str(Path(__file__).parent)}
        done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=timeout)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def start_fsci(*arguments) -> subprocess.Popen[str]:
    """Start `fsci` and go on."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen(command(*arguments), text=True, env=ENVIRONMENT, **pipes)
