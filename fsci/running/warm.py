"""One process that has imported what runs need: each run is a copy of it, and starts at once.

It is started as `python -m fsci.running.warm` with a socket as its standard input. For each run it gets a byte with one
end of a connection, over which a copy of it reads the words of the command and writes how the run has ended.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from array import array
from collections.abc import Sequence
from typing import Any

from fsci.running.child import environment
from fsci.running.copied_process import fsci, import_common, run_in_copy

PROCESS_HAS_ENDED = "the process that runs are copies of has ended"


class WarmProcess:
    """Runs commands of `fsci`, from any thread. The process that they are copies of is started with the first one.

    Ctrl-C reaches the runs, but not that process. It ends with this object, or with the process that has it.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._control: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> WarmProcess:
        return self

    def __exit__(self, *error: Any) -> None:
        if self._control is not None and self._process is not None:
            self._control.close()
            self._process.wait()

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """The end of a command, as of subprocess.run; without one its code is that of SIGKILL."""
        ours, theirs = socket.socketpair()
        with ours:
            try:
                with theirs, self._lock:
                    _send_handle(self._started(), theirs.fileno())
                _send(ours, list(arguments))
                code, out, errors = _receive(ours)
            except (OSError, ValueError):
                code, out, errors = -signal.SIGKILL, "", PROCESS_HAS_ENDED
        return subprocess.CompletedProcess(arguments, code, out, errors)

    def _started(self) -> socket.socket:
        if self._control is None:
            self._control, theirs = socket.socketpair()
            # it inherits that SIGINT waits, until it ignores it
            before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
            try:
                with theirs:
                    program = [sys.executable, "-m", "fsci.running.warm"]
                    self._process = subprocess.Popen(program, stdin=theirs.fileno(), env=environment())
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return self._control


def _send_handle(control: socket.socket, handle: int) -> None:
    """As socket.send_fds, but without SIGPIPE where the other end is gone: PETSc ends this process for it."""
    control.sendmsg([b"r"], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array("i", [handle]))], socket.MSG_NOSIGNAL)


def _send(connection: socket.socket, content: Any) -> None:
    connection.sendall(json.dumps(content).encode(), socket.MSG_NOSIGNAL)
    connection.shutdown(socket.SHUT_WR)


def _receive(connection: socket.socket) -> Any:
    """What the other end has sent. Raises ValueError if it was closed without that."""
    with connection.makefile("rb") as file:
        return json.loads(file.read())


def serve() -> None:
    """Be the process that runs are copies of, until the other end of standard input is closed."""
    on_interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # copies that have ended are gone
    control = socket.socket(fileno=os.dup(0))
    with open(os.devnull) as nothing:
        os.dup2(nothing.fileno(), 0)
    import_common()
    while True:
        request, handles, *_ = socket.recv_fds(control, 1, 1)
        if not request:
            return
        connection = socket.socket(fileno=handles[0])
        if os.fork() == 0:
            try:
                control.close()
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                _answer(connection, on_interrupt)
            finally:
                os._exit(0)
        connection.close()


def _answer(connection: socket.socket, on_interrupt: Any) -> None:
    """Run one command in a copy, and send its end."""

    def program(arguments: Sequence[str]) -> int:
        connection.close()
        signal.signal(signal.SIGINT, on_interrupt)
        return fsci(arguments)

    done = run_in_copy(program, _receive(connection), {})
    _send(connection, [done.returncode, done.stdout, done.stderr])


if __name__ == "__main__":
    serve()
