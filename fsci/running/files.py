"""The files of a results folder, which may come from somebody else: how they are found, opened and written.

No link within the folder is followed; the folder itself may be one. A file is written under a temporary name and then
renamed: what stands in its place, a link or a hard link too, is replaced and never written into.
"""

from __future__ import annotations

import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from fsci.case.errors import CaseError, Place, Problem

#: A folder with this file was created by a run; a later run may replace the files of runs in it.
MARKER = ".fsci-run"

#: The process that writes into the folder holds this file.
LOCK = ".fsci-lock"

FILES = ("case.yaml", "summary.json", "history.csv", "log.txt", "report.html", "STOP")
FOLDERS = ("fields", "checkpoint", "failure", "pictures")
COPIES = ("meshes", "curves", "laws")  #: folders of files that the case names and that have no place of their own

UNFINISHED = ".tmp"  #: ending of the names of files that are being written

_LINK = "is a link, and no link in a results folder is followed: put the file itself here, or remove the link"
_FILE, _FOLDER = "is a folder, not a file: remove it", "is a file, not a folder: remove it"
_SPECIAL = "is neither a file nor a folder: remove it"


def refused(path: Path, message: str) -> CaseError:
    """The error of a file or folder, with what to do."""
    return CaseError([Problem(Place(str(path)), message)])


def require_own(out: Path) -> None:
    """Raises CaseError for links, devices and pipes among the results in a folder; other files of the user may be any.

    A hundred thousand files take 0.1 s.
    """
    if not out.is_dir():
        return
    for entry in os.scandir(out):
        name = entry.name.removesuffix(UNFINISHED)
        if name in (*FILES, *FOLDERS, *COPIES, MARKER, LOCK):
            _require_plain(entry)
            if entry.is_dir() != (entry.name in (*FOLDERS, *COPIES)):
                raise refused(Path(entry.path), _FILE if entry.is_dir() else _FOLDER)


def _require_plain(entry: os.DirEntry[str]) -> None:
    if entry.is_symlink():
        raise refused(Path(entry.path), _LINK)
    if entry.is_dir(follow_symlinks=False):
        for inner in os.scandir(entry.path):
            _require_plain(inner)
    elif not entry.is_file(follow_symlinks=False):
        raise refused(Path(entry.path), _SPECIAL)


def make_folder(path: Path) -> None:
    """Make one folder within a results folder unless it is there. Raises CaseError for a link."""
    try:
        path.mkdir()
    except FileExistsError:
        if path.is_symlink():
            raise refused(path, _LINK) from None
        if not path.is_dir():
            raise


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """The temporary name of a new empty file, which replaces `path` in the end, whole or not at all."""
    unfinished = path.with_name(path.name + UNFINISHED)
    unfinished.unlink(missing_ok=True)  # of a run that was killed
    os.close(os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666))
    try:
        yield unfinished
        os.replace(unfinished, path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


def write_text(path: Path, text: str) -> None:
    """Replace a file whole or not at all."""
    with replacing(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8")


def copy_file(source: Path, target: Path) -> None:
    """Replace a file by a copy of another one, whole or not at all."""
    with replacing(target) as unfinished:
        shutil.copyfile(source, unfinished)


def open_to_append(path: Path) -> TextIO:
    """A text file for more lines: a copy of what is there, under the same name. Raises CaseError for a link."""
    try:
        mode = os.lstat(path).st_mode
    except FileNotFoundError:
        write_text(path, "")
    else:
        if not stat.S_ISREG(mode):
            raise refused(path, _LINK if stat.S_ISLNK(mode) else _SPECIAL)
        copy_file(path, path)
    return os.fdopen(os.open(path, os.O_WRONLY | os.O_APPEND | os.O_NOFOLLOW), "a", encoding="utf-8")
