"""Messages of commands that fail, and their exit codes."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable


def with_notes(error: Exception) -> str:
    """Its text, and below it what the run has to say about its state."""
    return "\n".join([str(error), *getattr(error, "__notes__", ())])


def fail(message: str) -> int:
    """Say why a command cannot do what it is asked to."""
    print(message, file=sys.stderr)
    return 2


def broken(command: str, error: BaseException) -> int:
    """Say what ended a run on one process: the machine or the user."""
    from fsci.running.processes import describe

    print(f"fsci {command}: {describe(error)}", file=sys.stderr)
    return 3 if isinstance(error, KeyboardInterrupt) else 1


def as_far_as_it_is_read(command: Callable[[], int]) -> int:
    """Exit code of a command whose output may have a reader that stops, such as `head`: then it ends without a word."""
    try:
        code = command()
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python writes the rest at its end
        return 1
    return code
