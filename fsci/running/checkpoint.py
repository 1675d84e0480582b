"""Checkpoints: the state of a run in HDF5, exact to the last bit, safe against a kill at any moment.

A state is nested names with arrays, numbers, text, truth values, None and lists of these at the ends. Names
become groups and arrays datasets, so that any HDF5 tool can look inside; all other values are JSON text.
The first bytes of the file (the user block, which HDF5 skips) hold a checksum of the rest.
"""

from __future__ import annotations

import io
import json
import os
import re
import warnings
import zlib
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np

from fsci.running.files import make_folder, replacing
from solvers.api import State

KEEP = 2  #: checkpoints kept
USER_BLOCK = 512  #: bytes before the HDF5 data; 512 is the least HDF5 allows


def write_checkpoint(folder: Path, state: State, meta: State) -> Path:
    """Writes folder/checkpoint_<step>.h5, with the step number from meta["step"], and keeps the one before.

    The file gets its name only when it is complete and on the disk. Checkpoints of later steps, left by what
    the run did before it was restarted, are removed. Raises TypeError, naming the entry it cannot keep.
    """
    import h5py

    folder = Path(folder)
    make_folder(folder)
    step = int(meta["step"])
    path = folder / f"checkpoint_{step:06d}.h5"
    buffer = io.BytesIO()  # HDF5 may crash when the disk is full
    with h5py.File(buffer, "w", userblock_size=USER_BLOCK) as file:
        write_tree(file.create_group("state", track_order=True), state)
        write_tree(file.create_group("meta", track_order=True), meta)
    with buffer.getbuffer() as content:
        seal = seal_of(len(content) - USER_BLOCK, zlib.crc32(content[USER_BLOCK:]))
        content[: len(seal)] = seal
        try:
            with replacing(path) as unfinished:
                with unfinished.open("wb") as raw:
                    raw.write(content)
                    raw.flush()
                    os.fsync(raw.fileno())
                for later in list_checkpoints(folder):
                    if step_of(later) > step:
                        later.unlink()
        except OSError as error:
            raise OSError(error.errno, f"cannot write a checkpoint: {error.strerror}", str(path)) from error

    sync_folder(folder)
    for old in [*list_checkpoints(folder)[KEEP:], *folder.glob("checkpoint_*.h5.tmp")]:
        old.unlink()
    return path


def read_checkpoint(folder: Path) -> tuple[State, State]:
    """Reads (state, meta) of the newest complete checkpoint.

    Warns, naming the file, about damaged ones it skips; raises FileNotFoundError if none is left.
    """
    import h5py

    folder = Path(folder)
    for path in list_checkpoints(folder):
        with path.open("rb") as raw:
            seal = raw.read(USER_BLOCK).rstrip(b"\0")
        if seal != checksum(path):
            warnings.warn(f"{path} is damaged or incomplete and is skipped", stacklevel=2)
            continue
        with h5py.File(path, "r") as file:
            return read_tree(file["state"]), read_tree(file["meta"])
    raise FileNotFoundError(f"no usable checkpoint in {folder}")


def list_checkpoints(folder: Path) -> list[Path]:
    """The checkpoints of a folder, newest first."""
    found = [path for path in folder.glob("checkpoint_*.h5") if re.fullmatch(r"checkpoint_\d+", path.stem)]
    return sorted(found, key=step_of, reverse=True)


def step_of(path: Path) -> int:
    """The step number in the name of a checkpoint."""
    return int(path.stem.rpartition("_")[2])


def checksum(path: Path) -> bytes:
    """The user block of a checkpoint: size and CRC-32 of the rest of the file."""
    size, code = 0, 0
    with path.open("rb") as raw:
        raw.seek(USER_BLOCK)
        while block := raw.read(1 << 22):
            size, code = size + len(block), zlib.crc32(block, code)
    return seal_of(size, code)


def seal_of(size: int, code: int) -> bytes:
    """The user block's content for a size [bytes] and a CRC-32."""
    return f"fsci checkpoint, {size} bytes, crc32 {code:08x}\n".encode()


def sync_folder(folder: Path) -> None:
    """Makes a rename in the folder survive a power failure."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_tree(group: Any, tree: State) -> None:
    """Writes nested names into an HDF5 group."""
    for name, value in tree.items():
        if not isinstance(name, str):
            raise TypeError(f"checkpoint {group.name}: the name {name!r} is not text")
        key = quote(name, safe=" ")
        if isinstance(value, dict):
            write_tree(group.create_group(key, track_order=True), value)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
            group.create_dataset(key, data=value)
        else:
            group.create_dataset(key, data=json.dumps(plain(value, f"{group.name}/{name}")))


def read_tree(group: Any) -> State:
    """Inverse of write_tree. Raises OSError for a link, which may lead to another file."""
    import h5py

    tree: State = {}
    for key in group:
        if not isinstance(group.get(key, getlink=True), h5py.HardLink) or getattr(group[key], "external", None):
            raise OSError(f"the checkpoint has a link, {group.name}/{key}: a run did not write it; remove the file")
        name, item = unquote(key), group[key]
        if isinstance(item, h5py.Group):
            tree[name] = read_tree(item)
        elif h5py.check_string_dtype(item.dtype):
            tree[name] = json.loads(item[()])
        else:
            tree[name] = np.asarray(item[()])
    return tree


def plain(value: Any, place: str) -> Any:
    """A value as JSON keeps it exactly; numpy scalars become Python's. Raises TypeError for anything else."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, list):
        return [plain(item, f"{place}[{index}]") for index, item in enumerate(value)]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"checkpoint {place}: cannot keep a {type(value).__name__} exactly")
