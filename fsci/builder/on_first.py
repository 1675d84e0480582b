"""Reading and writing on the first process, whose failures reach all of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


def on_first(comm: Any, call: Callable[[], T]) -> T | None:
    """The result on the first process, None on the others; its exception on all of them (collective)."""
    result, error = None, None
    if comm.rank == 0:
        try:
            result = call()
        except Exception as raised:  # raised on every process below
            error = raised
    error = comm.bcast(error, root=0)
    if error is not None:
        raise error
    return result


def shared(comm: Any, call: Callable[[], T]) -> T:
    """The result on the first process, or its exception, on every process (collective)."""
    return comm.bcast(on_first(comm, call), root=0)  # type: ignore[no-any-return]
