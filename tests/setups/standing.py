"""Two processes that have started MPI and imported what runs need: programs of tests run in them, one after the other.

To start mpirun for each costs 2 seconds of work. What depends on the start or the end of a process needs its own.
"""

from __future__ import annotations

import ctypes
import faulthandler
import gc
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping, Sequence
from importlib import import_module
from multiprocessing.connection import Connection, wait
from pathlib import Path

COUNT = 2
SECONDS_TO_START = 120.0
#: Packages whose functions a program must leave as they were.
SHARED = ("coupling", "dolfinx", "fsci", "mpi4py", "petsc4py", "solvers")
#: Time [s] that the others have to end once one has failed, as mpirun ends them.
SECONDS_TO_END = 10.0
#: Time [s] in which those whose time is over write where they are.
SECONDS_TO_SAY = 2.0


class StandingProcesses:
    """Runs programs, each with both processes. They start with the first, and anew after one that ends them."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self._environment = environment
        self._connections: list[Connection] = []
        self._mpirun: subprocess.Popen[bytes] | None = None

    def run(self, program: str, words: Sequence[str], timeout: float) -> subprocess.CompletedProcess[str]:
        """`program`: "fsci" or a file in Python. As subprocess.run of mpirun; raises TimeoutExpired like it."""
        if self._mpirun is None or self._mpirun.poll() is not None:
            self._mpirun = self._start()
        with tempfile.TemporaryDirectory() as folder:
            out, errors = (Path(folder, name) for name in ("out", "errors"))
            for connection in self._connections:
                connection.send((program, list(words), os.getcwd(), str(out), str(errors)))
            try:
                code = self._end(timeout)
            except subprocess.TimeoutExpired as late:
                self._mpirun.send_signal(signal.SIGUSR1)  # mpirun sends it to both, which write where they are
                time.sleep(SECONDS_TO_SAY)
                self.close(kill=True)
                places = [path.read_text() for path in sorted(Path(folder).glob("place*"))]
                raise subprocess.TimeoutExpired("\n".join([program, *words, *places]), late.timeout) from None
            return subprocess.CompletedProcess([program, *words], code, out.read_text(), errors.read_text())

    def close(self, kill: bool = False) -> None:
        """End the processes."""
        for connection in self._connections:
            connection.close()
        self._connections = []
        if self._mpirun is not None:
            if kill:
                self._mpirun.terminate()
            self._mpirun.wait(60.0)
            self._mpirun = None

    def _start(self) -> subprocess.Popen[bytes]:
        self.close()
        with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as server:
            address = str(Path(folder, "socket"))
            server.bind(address)
            server.listen(COUNT)
            server.settimeout(SECONDS_TO_START)
            words = ["mpirun", "-n", str(COUNT), sys.executable, __file__, address]
            quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            started = subprocess.Popen(words, env=self._environment, **quiet)
            self._connections = [Connection(server.accept()[0].detach()) for _ in range(COUNT)]
        return started

    def _end(self, timeout: float) -> int:
        """Wait for the codes of all processes; their first one that is not 0, or that of mpirun if it has ended."""
        begin, left, code = time.monotonic(), list(self._connections), 0
        assert self._mpirun is not None
        while left:
            ready = wait(left, max(0.0, timeout - (time.monotonic() - begin)))
            if not ready and code:  # those that have not failed would wait for ever
                self.close(kill=True)
                return code
            if not ready:
                raise subprocess.TimeoutExpired("mpirun", timeout)
            for connection in ready:
                try:
                    answer = connection.recv()
                except (EOFError, ConnectionResetError):
                    return self._mpirun.wait(60.0)
                left.remove(connection)
                code = code or answer
            if code:
                timeout = min(timeout, time.monotonic() - begin + SECONDS_TO_END)
        return code


def serve(address: str) -> None:
    """Be one of the processes, until the other end is closed."""
    from mpi4py import MPI

    from fsci.running.copied_process import MODULES_OF_RUNS

    for module in MODULES_OF_RUNS:
        import_module(module)
    gc.freeze()
    connected = socket.socket(socket.AF_UNIX)
    connected.connect(address)
    connection = Connection(connected.detach())
    while True:
        try:
            program, words, folder, out, errors = connection.recv()
        except (EOFError, ConnectionResetError):
            return
        os.chdir(folder)
        _print_to(out, errors)
        before = _functions()
        place = Path(errors).with_name(f"place{MPI.COMM_WORLD.rank}").open("w")
        faulthandler.register(signal.SIGUSR1, place)
        try:
            code = _run(program, words)
            for name in _restored(before):
                print(f"the program has left {name} changed", file=sys.stderr)
                code = code or 1
        except BaseException:
            traceback.print_exc()
            sys.stderr.flush()
            MPI.COMM_WORLD.Abort(1)
        faulthandler.unregister(signal.SIGUSR1)
        place.close()
        gc.collect()  # here all processes let go of what they share
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        ctypes.CDLL(None).fflush(None)
        os.chdir("/")
        connection.send(code)


def _run(program: str, words: Sequence[str]) -> int:
    from programs import fsci_here, python_here

    return fsci_here(words) if program == "fsci" else python_here([program, *words])


def _functions() -> dict[tuple[str, str], object]:
    """Functions and classes of the modules that programs share, by module and name."""
    modules = [(name, module) for name, module in sys.modules.items() if name.partition(".")[0] in SHARED]
    return {(name, key): at for name, module in modules for key, at in vars(module).items() if callable(at)}


def _restored(before: Mapping[tuple[str, str], object]) -> list[str]:
    """Put functions back that are others than before; their names."""
    found = []
    for (name, key), at in before.items():
        if getattr(sys.modules[name], key, None) is not at:
            setattr(sys.modules[name], key, at)
            found.append(f"{name}.{key}")
    return found


def _print_to(*paths: str) -> None:
    """Both processes append to the same files."""
    for number, path in enumerate(paths, 1):
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.dup2(file, number)
        os.close(file)
    sys.stdout, sys.stderr = (open(number, "w", closefd=False) for number in (1, 2))


if __name__ == "__main__":
    serve(sys.argv[1])
