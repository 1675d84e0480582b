"""The processes of a run end together: the others would wait for ever for one that has failed alone."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

#: Time [s] within which a failure of all processes has reached all of them.
SECONDS_TO_FAIL = 5.0


@contextmanager
def ending_together(comm: Any, *shared: type[Exception]) -> Iterator[None]:
    """An exception in one process prints its message and ends all processes with exit code 1.

    On one process it is passed on, also one of the types `shared`, which all processes raise alike, once all have.
    """
    try:
        yield
    except BaseException as error:
        if comm.size == 1 or isinstance(error, SystemExit) or (isinstance(error, shared) and _all_are_here(comm)):
            raise
        sys.stdout.flush()
        print(f"process {comm.rank} of {comm.size} failed, and all processes end: {describe(error)}", file=sys.stderr)
        sys.stderr.flush()
        comm.Abort(1)


def describe(error: BaseException) -> str:
    """The message for the user: that of a disk or memory error, else the traceback."""
    if isinstance(error, MemoryError):
        return ". ".join(["there is not enough memory", *getattr(error, "__notes__", ())])
    if isinstance(error, KeyboardInterrupt):
        return "stopped before the first step"
    if isinstance(error, OSError):
        what = error.strerror or str(error)
        return f"{what}: '{error.filename}'" if error.filename else what
    return "".join(traceback.format_exception(error)).rstrip()


def _all_are_here(comm: Any) -> bool:
    """All processes have called this within some time."""
    here, end = comm.Ibarrier(), time.monotonic() + SECONDS_TO_FAIL
    while not here.Test():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True
