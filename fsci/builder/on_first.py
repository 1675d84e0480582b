"""Reading on the first process for all of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mpi4py import MPI


def on_first(comm: MPI.Comm, read: Callable[[], Any]) -> Any:
    """The result of reading on the first process, or its exception, on every process (collective)."""
    found: Any = None
    if comm.rank == 0:
        try:
            found = read()
        except Exception as raised:  # raised on every process below
            found = raised
    found = comm.bcast(found, root=0)
    if isinstance(found, Exception):
        raise found
    return found
