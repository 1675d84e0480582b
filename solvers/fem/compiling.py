"""The cache of compiled forms, shared by all programs of a user: which process compiles, which ones wait, messages.

DOLFINx marks a form that is being compiled by a .c file without a .c.cached beside it. It waits for such a mark as
long as its timeout allows, also when the process that made it was killed. Here the process that compiles locks a file.
The system unlocks it when the process ends, however it ends.
"""

from __future__ import annotations

import fcntl
import logging
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import IO, Any

from ffcx.codegeneration import jit

from solvers.fem import libraries

#: Time [s] that a program without such locks has from its last change of the .c file.
FOREIGN = 30.0

#: How often a process looks whether another one is done [s].
INTERVAL = 0.2

_listeners: list[Callable[[str], None]] = []

#: what FFCx's compiler calls, and is given another of here
_REPLACED = ("get_cached_module", "_load_objects", "cffi")


@contextmanager
def listening(say: Callable[[str], None]) -> Iterator[None]:
    """`say` gets one line for each part that is compiled or waited for in this process."""
    _listeners.append(say)
    try:
        yield
    finally:
        _listeners.remove(say)


def _say(text: str) -> None:
    for listener in _listeners:
        listener(text)


@contextmanager
def compiling(what: str) -> Iterator[None]:
    """Calls of DOLFINx's compiler inside wait for, or replace, what other processes have begun.

    They are silent: setuptools reports every compiler call at INFO on the root logger, and sets its level itself.
    """
    disabled, originals = logging.root.manager.disable, {name: getattr(jit, name) for name in _REPLACED}
    locks: list[IO[bytes]] = []

    def get_cached_module(name: str, objects: list[str], cache_dir: Path, timeout: int) -> tuple[Any, Any]:
        source = Path(cache_dir) / f"{name}.c"
        lock = None if _ready(source) else _take(source, what)
        if lock is None:
            return libraries.load(source.parent, name, objects)
        locks.append(lock)
        _say(f"compiling {what}")
        source.write_bytes(b"")
        return None, None

    logging.disable(logging.INFO)
    jit.get_cached_module, jit._load_objects = get_cached_module, libraries.load
    jit.cffi = SimpleNamespace(FFI=libraries.Builder)
    try:
        yield
    finally:
        for name, original in originals.items():
            setattr(jit, name, original)
        logging.disable(disabled)
        for lock in locks:
            if _ready(Path(lock.name)):
                os.unlink(lock.name)
            lock.close()


def _ready(source: Path) -> bool:
    return source.with_suffix(".c.cached").exists()


def _take(source: Path, what: str) -> IO[bytes] | None:
    """The lock of a module that this process is to compile; None if another one has done so in the meantime."""
    source.parent.mkdir(parents=True, exist_ok=True)
    path = source.with_suffix(".lock")
    known = path.exists()
    lock = path.open("wb")
    if not _locked(lock):
        _say(f"waiting for another process that compiles {what}")
        while not _locked(lock):
            time.sleep(INTERVAL)
    elif not known and _changed(source):
        _say(f"waiting up to {FOREIGN:.0f} s for another program that seems to compile {what} ({source})")
        while not _ready(source) and _changed(source):
            time.sleep(INTERVAL)
    if _ready(source):
        lock.close()
        return None
    if source.exists():
        _say("the process that was compiling it has been killed; compiling it again")
    return lock


def _locked(lock: IO[bytes]) -> bool:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True


def _changed(source: Path) -> bool:
    """The file exists and was changed a short time ago."""
    try:
        return time.time() - os.stat(source).st_mtime < FOREIGN
    except FileNotFoundError:
        return False
