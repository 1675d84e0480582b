"""Programs in a copy of this process: what it has imported is there, what they change is gone with it."""

from __future__ import annotations

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

#: what runs import first when they need it; to import it here saves each copy about a second
COMMON = ("fsci.run.run", "fsci.builder.build", "h5py", "meshio", "gmsh")


def fsci(arguments: Sequence[str]) -> int:
    """Run a command of `fsci` in this process; returns its exit code."""
    from fsci.cli import execute

    sys.argv = ["fsci", *arguments]
    return _exit_code(lambda: execute(arguments))


def python(arguments: Sequence[str]) -> int:
    """Run a Python program, the first one of the words, in this process; returns its exit code."""
    sys.argv = list(arguments)
    return _exit_code(lambda: (runpy.run_path(arguments[0], run_name="__main__"), 0)[1])


def _exit_code(program: Callable[[], int]) -> int:
    """What it returns, or the code that it would end this process with."""
    try:
        return program()
    except SystemExit as end:
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
        return end.code if isinstance(end.code, int) else int(end.code is not None)


def printing_to(out: int, errors: int) -> None:
    """From now on the output of this process goes to these file descriptors, that of C and C++ as well."""
    os.dup2(out, 1)
    os.dup2(errors, 2)
    sys.stdout, sys.stderr = (open(number, "w", closefd=False) for number in (1, 2))


def run_in_copy(
    program: Callable[[Sequence[str]], int], arguments: Sequence[str], environment: Mapping[str, str], timeout: float
) -> subprocess.CompletedProcess[str]:
    """Call `program(arguments)` in a copy of this process. Raises TimeoutExpired like subprocess.run."""
    for module in COMMON:
        import_module(module)
    with TemporaryFile() as out, TemporaryFile() as errors:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()  # else the copy would print it again
        child = os.fork()
        if child == 0:
            code = 1
            try:
                os.environ.update(environment)
                printing_to(out.fileno(), errors.fileno())
                code = program(arguments)
            except BaseException:
                traceback.print_exc()
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(code)
        code = _wait(child, arguments, timeout)
        return subprocess.CompletedProcess(list(arguments), code, _text(out), _text(errors))


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
