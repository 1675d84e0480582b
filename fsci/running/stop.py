"""Ending a run on SIGTERM, SIGINT or SIGUSR1: after its step if that is soon, else at once with the last good state."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from typing import Any

#: Open MPI 5 passes SIGUSR1 on and waits; after SIGTERM it kills its processes 0.25 s later.
SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1)

#: Time [s] that a step has to come to its end after a signal. The `mpirun` of Open MPI 4 kills its processes a second
#: or more after it has passed SIGTERM on.
GRACE = 0.3


class StopWatch:
    """Handles signals while it is entered.

    The run loop tests `requested` between steps. If it does not call `ended()` within GRACE, a thread calls `give_up`,
    which writes the last state and ends the process. Python calls signal handlers only between two of its own
    operations. Hence a pipe wakes the thread, also during a long call that releases Python's lock.

    `files` is a lock for all changes of files and of the state that they contain.
    """

    def __init__(self, give_up: Callable[[], None] | None):
        """`give_up` is None on processes that write no files."""
        self.requested = False
        self.files = threading.RLock()
        self._give_up, self._ended = give_up, threading.Event()
        self._thread = threading.Thread(target=self._watch, name="signals", daemon=True)
        self._read = self._write = self._before = -1  # file descriptors, of the pipe and of another one before
        self._handlers: dict[signal.Signals, Any] = {}

    def __enter__(self) -> StopWatch:
        self._read, self._write = os.pipe()
        os.set_blocking(self._write, False)
        self._handlers = {number: signal.signal(number, self._on_signal) for number in SIGNALS}
        self._before = signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)
        self._thread.start()
        return self

    def __exit__(self, *error: Any) -> None:
        signal.set_wakeup_fd(self._before)
        for number, handler in self._handlers.items():
            signal.signal(number, handler)
        self.ended()
        os.write(self._write, b"\0")
        self._thread.join()
        os.close(self._read)
        os.close(self._write)

    def ended(self) -> None:
        """Tell the thread that the run loop writes the last state itself."""
        self._ended.set()

    def _on_signal(self, number: int, frame: Any) -> None:
        self.requested = True

    def _watch(self) -> None:
        while True:
            byte = os.read(self._read, 1)[0]
            if byte == 0:
                return
            if byte in SIGNALS:
                self.requested = True
                break
        if self._ended.wait(GRACE) or self._give_up is None:
            return
        with self.files:
            if not self._ended.is_set():
                self._give_up()
