"""Messages of commands that fail, and their exit codes."""

from __future__ import annotations

import sys


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
