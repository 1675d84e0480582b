"""The results folder of a run: made ready without losing anything that a run did not write."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from fsci.case import Case, CaseError
from fsci.running.files import FILES, FOLDERS, LOCK, MARKER, UNFINISHED, refused, require_own, write_text
from fsci.running.kept_case import copies, keep_case
from fsci.running.lock import Lock
from fsci.running.output import FORMATS, is_output_of
from fsci.running.vtkhdf import VTKHDF_FILE

MARKER_TEXT = "The results of a run of fsci. Another run into this folder replaces the files that runs write.\n"

#: Names of the pictures in a folder, one a line: `fsci plot` draws them, the next run removes them.
PICTURE_LIST = ".fsci-pictures"


def prepare_folder(case: Case, out: Path, *, force: bool = False) -> Lock:
    """An empty results folder with everything needed to repeat the run: the case and the files it names.

    A folder that has content and no marker of a run, and the folder of the case itself, are refused. With `force` they
    are taken: whatever stands where the run writes is renamed to NAME.old. Returns the lock of the folder, for as long
    as the run writes into it. Raises CaseError.
    """
    own = out.exists() and out.resolve() == case.folder.resolve()
    foreign = own or (out.is_dir() and bool({path.name for path in out.iterdir()} - {LOCK}) and not _marked(out))
    if foreign and not force:
        what = "is the folder of the case itself" if own else "has files that no run wrote"
        raise _refused(out, f"this folder {what}; choose another one, or keep these files as NAME.old with --force")
    if not foreign:
        require_own(out)
    try:
        out.mkdir(parents=True, exist_ok=True)
        lock = Lock(out)
        if foreign:
            unfinished = [name + UNFINISHED for name in FILES]
            for path in (*(out / name for name in (*FILES, *unfinished, *FOLDERS)), *_copies(case, out)):
                _set_aside(path)
            require_own(out)
        else:
            _remove_results(out)
        keep_case(case, out)
        write_text(out / MARKER, MARKER_TEXT)
    except OSError as error:
        raise _refused(out, f"cannot write here: {error.strerror or error}") from None
    return lock


def _marked(out: Path) -> bool:
    return (out / MARKER).is_file()


def list_pictures(folder: Path, drawn: list[Path]) -> None:
    """Write a list of the pictures in a folder, so that the next run can tell them from files of the user."""
    write_text(folder / PICTURE_LIST, "".join(f"{path.name}\n" for path in sorted({*_pictures(folder), *drawn})))


def _pictures(folder: Path) -> list[Path]:
    """The pictures in the list of a folder; it may have been written by somebody else."""
    listed = folder / PICTURE_LIST
    names = listed.read_text(encoding="utf-8", errors="replace").splitlines() if listed.is_file() else []
    return [folder / name for name in names if re.fullmatch(r"[^/\0]+\.(png|gif|mp4|csv)", name)]


def _refused(out: Path, message: str) -> CaseError:
    return refused(Path(f"-o {out}"), message)


# ------------------------------------------------------------------------------------------- what stands there already


def _copies(case: Case, out: Path) -> Iterator[Path]:
    """Paths of the copies of meshes and curves, except those that are the originals themselves."""
    for file, kept in copies(case):
        if file.resolve() != (out / kept).resolve():
            yield out / kept


def _set_aside(path: Path) -> None:
    """Rename an existing file or folder: NAME.old, NAME.old2, ..."""
    if path.exists() or path.is_symlink():
        names = (path.with_name(f"{path.name}.old{number or ''}") for number in (0, *range(2, 1000)))
        path.rename(next(free for free in names if not free.exists()))


def _remove_results(out: Path) -> None:
    """Remove the files that the last run wrote, and only these; folders go if nothing is left in them."""
    if not out.is_dir():
        return
    for name in FILES:
        (out / name).unlink(missing_ok=True)
    for path in _results(out):
        path.unlink(missing_ok=True)
    for name in ("failure/fields", *FOLDERS):
        folder = out / name
        if folder.is_dir() and not folder.is_symlink() and not any(folder.iterdir()):
            folder.rmdir()


def _results(out: Path) -> list[Path]:
    """Files that runs write into the folders of `out`."""
    found = [*_checkpoints(out / "checkpoint"), *_checkpoints(out / "failure")]
    found += [*_fields(out / "fields"), *_fields(out / "failure" / "fields"), out / "fields" / VTKHDF_FILE]
    found += [out / "failure" / name for name in ("case.yaml", "failure.json")]
    found += [*_pictures(out / "pictures"), out / "pictures" / PICTURE_LIST]
    return found


def _checkpoints(folder: Path) -> list[Path]:
    return [path for path in folder.glob("checkpoint_*") if re.fullmatch(r"checkpoint_\d+\.h5(\.tmp)?", path.name)]


def _fields(folder: Path) -> list[Path]:
    """The collections, and the files of the parts that they name."""
    found: list[Path] = []
    for collection in folder.glob("*.pvd"):
        names = {path: path.name.removesuffix(UNFINISHED) for path in folder.iterdir()}
        steps = [path for path, name in names.items() if is_output_of(collection.stem, name, FORMATS)]
        found += [*steps, collection] if steps else []
    return found
