"""One run, one folder: the process that writes into a results folder locks it."""

from __future__ import annotations

import fcntl
import os
import platform
import re
from pathlib import Path

from fsci.running.files import LOCK, refused

#: What a lock says of its holder.
HOLDER = re.compile(r"process (\d+) on (\S+)\n")


class Lock:
    """Holds a results folder until it is released or the process ends, however it ends.

    The system keeps the lock (flock). The file says who holds it, and is empty once a run has ended by itself. On file
    systems without locks, and of a run on another computer, what the file says has to do.
    """

    def __init__(self, out: Path):
        """Raises CaseError if a run holds the folder, or a run on another computer may do so."""
        self.path = out / LOCK
        descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
        self._file = os.fdopen(descriptor, "r+b", buffering=0)
        try:
            self._take(out)
        except BaseException:
            self._file.close()
            raise
        self._file.truncate(0)
        os.pwrite(descriptor, f"process {os.getpid()} on {platform.node()}\n".encode(), 0)

    def _take(self, out: Path) -> None:
        found = HOLDER.fullmatch(os.pread(self._file.fileno(), 1000, 0).decode("utf-8", "replace"))
        who = f"process {found[1]} on {found[2]}" if found else "which has just begun"
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            free = True
        except BlockingIOError:
            raise refused(out, f"a run ({who}) writes here: {_STOP}") from None
        except OSError:  # a file system without locks
            free = False
        if found is None:
            return
        if found[2] != platform.node():
            raise refused(
                out, f"a run ({who}) has not ended by itself, or still writes here: {_STOP}; {_GONE.format(self.path)}"
            )
        if not free and int(found[1]) != os.getpid() and _alive(int(found[1])):
            raise refused(out, f"a run ({who}) writes here: {_STOP}; {_GONE.format(self.path)}")

    def close(self) -> None:
        """Let others write; calling it again does nothing."""
        if not self._file.closed:
            self._file.truncate(0)
            self._file.close()


_STOP = "wait until it ends, stop it with a file STOP in this folder, or choose another folder with -o"
_GONE = "if that process is gone, remove {}"


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # of another user
        pass
    return True
