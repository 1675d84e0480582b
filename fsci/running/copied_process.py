"""Programs in a copy of this process: what it has imported is there, what they change is gone with it."""

from __future__ import annotations

import math
import os
import runpy
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from tempfile import TemporaryFile
from typing import IO

Program = Callable[[Sequence[str]], int]

#: What runs import: to do so here saves each copy about a second.
MODULES_OF_RUNS = (
    "fsci.running.run",
    "fsci.builder.build",
    "fsci.builder.fluid",
    "fsci.builder.structure",
    "fsci.builder.contact",
    "h5py",
    "meshio",
    "gmsh",
)
TRANSPORT = "OMPI_MCA_btl"  #: Open MPI reads it at its start


def import_common() -> None:
    """Import what runs need."""
    start_mpi_alone()
    for module in MODULES_OF_RUNS:
        import_module(module)


def start_mpi_alone() -> None:
    """MPI for this process alone, if it has not been started.

    Open MPI would listen on a port. Copies share it, and have no thread to answer: a stranger that connects stops them.
    """
    before = os.environ.get(TRANSPORT)
    os.environ[TRANSPORT] = "self"
    import_module("mpi4py.MPI")
    if before is None:
        del os.environ[TRANSPORT]
    else:
        os.environ[TRANSPORT] = before


def fsci(arguments: Sequence[str]) -> int:
    """Run a command of `fsci` in this process; returns its exit code."""
    sys.argv = ["fsci", *arguments]
    return exit_code(lambda: runpy.run_module("fsci", run_name="__main__"))


def exit_code(program: Callable[[], object]) -> int:
    """The code that a program ends this process with, 0 if it returns."""
    try:
        program()
    except SystemExit as end:
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


def run_in_copy(
    program: Program, arguments: Sequence[str], environment: Mapping[str, str], timeout: float = math.inf
) -> subprocess.CompletedProcess[str]:
    """Call `program(arguments)` in a copy of this process, which must have no threads that hold locks.

    Raises TimeoutExpired like subprocess.run.
    """
    with TemporaryFile() as out, TemporaryFile() as errors:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()  # else the copy would print it again
        child = os.fork()
        if child == 0:
            code = 1
            try:
                os.environ.update(environment)
                _print_to(out.fileno(), errors.fileno())
                code = program(arguments)
            except BaseException:
                traceback.print_exc()
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(code)
        code = _wait(child, arguments, timeout)
        return subprocess.CompletedProcess(list(arguments), code, _text(out), _text(errors))


def _print_to(out: int, errors: int) -> None:
    """From now on the output of this process goes to these file descriptors, that of C and C++ as well."""
    os.dup2(out, 1)
    os.dup2(errors, 2)
    sys.stdout, sys.stderr = (open(number, "w", closefd=False) for number in (1, 2))


def _wait(child: int, arguments: Sequence[str], timeout: float) -> int:
    """The exit code of a child; that of one that a signal killed is negative."""
    end, pause = time.monotonic() + timeout, 0.001
    while True:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > end:
            os.kill(child, 9)
            os.waitpid(child, 0)
            raise subprocess.TimeoutExpired(list(arguments), timeout)
        time.sleep(pause)
        pause = min(2.0 * pause, 0.02)


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode()
