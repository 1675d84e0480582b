"""The results folder of a run: made ready without losing anything that a run did not write."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fsci.case import Case, CaseError
from fsci.case.errors import Place, Problem
from fsci.run.output import write_text

#: A folder with this file was created by a run; a later run may replace the files of runs in it.
MARKER = ".fsci-run"
MARKER_TEXT = "The results of a run of fsci. Another run into this folder replaces the files that runs write.\n"

#: Names of the pictures in a folder, one a line: `fsci plot` draws them, the next run removes them.
PICTURE_LIST = ".fsci-pictures"

FILES = ("case.yaml", "summary.json", "history.csv", "log.txt", "report.html", "STOP")
FOLDERS = ("fields", "checkpoint", "failure", "pictures")


def prepare_folder(case: Case, out: Path, *, force: bool = False) -> None:
    """An empty results folder with everything needed to repeat the run: the case and the files it names.

    A folder that has content and no marker of a run, and the folder of the case itself, are refused. With `force` they
    are taken: whatever stands where the run writes is renamed to NAME.old. Raises CaseError.
    """
    own = out.exists() and out.resolve() == case.folder.resolve()
    foreign = own or (out.is_dir() and any(out.iterdir()) and not (out / MARKER).is_file())
    if foreign and not force:
        what = "is the folder of the case itself" if own else "has files that no run wrote"
        raise _refused(out, f"this folder {what}; choose another one, or keep these files as NAME.old with --force")
    try:
        if foreign:
            for path in (*(out / name for name in (*FILES, *FOLDERS)), *_copies(case, out)):
                _set_aside(path)
        else:
            _remove_results(out)
        keep_case(case, out)
        write_text(out / MARKER, MARKER_TEXT)
    except OSError as error:
        raise _refused(out, f"cannot write here: {error.strerror or error}") from None


def keep_case(case: Case, folder: Path) -> None:
    """Write case.yaml and the files it names, such that the folder can be moved and run again."""
    folder.mkdir(parents=True, exist_ok=True)
    changes = []
    for setting, given, kept in _files(case):
        if given != kept:
            changes.append((setting, json.dumps(kept.as_posix())))
        _copy(case.folder / given, folder / kept)
    write_text(folder / "case.yaml", case.dump(changes))


def list_pictures(folder: Path, drawn: list[Path]) -> None:
    """Write a list of the pictures in a folder, so that the next run can tell them from files of the user."""
    listed = folder / PICTURE_LIST
    names = set(listed.read_text(encoding="utf-8").splitlines()) if listed.exists() else set()
    write_text(listed, "".join(f"{name}\n" for name in sorted(names | {path.name for path in drawn})))


def _refused(out: Path, message: str) -> CaseError:
    return CaseError([Problem(Place(f"-o {out}"), message)])


def _copy(source: Path, target: Path) -> None:
    """Replace `target` atomically; a link itself is replaced, not its target."""
    if source.resolve() == target.resolve():
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    unfinished = target.with_name(target.name + ".tmp")
    shutil.copyfile(source, unfinished)
    os.replace(unfinished, target)


def _files(case: Case) -> Iterator[tuple[str, Path, Path]]:
    """(setting, file, name of its copy in a results folder) of all meshes and curves that are in files beside the case.

    Settings have dots between their names.
    """
    for setting, name, given in _named_files(case):
        if given is None or Path(given).is_absolute():
            continue
        # no results folder writes outside itself
        folder = Path("curves" if setting.startswith("curves.") else "meshes")
        kept = folder / name / Path(given).name if ".." in Path(given).parts else Path(given)
        yield setting, Path(given), kept


def _named_files(case: Case) -> Iterator[tuple[str, str, str | None]]:
    """(setting, name of what it is for, file if it is one) of the meshes of bodies and obstacles, and of curves."""
    groups: dict[str, Mapping[str, Any]] = {
        "structure.bodies": case.elastic_bodies,
        "fluid.bodies": {} if case.fluid is None else case.fluid.bodies,
        "contact.obstacles": {} if case.contact is None else case.contact.obstacles,
    }
    for group, members in groups.items():
        for name, member in members.items():
            yield f"{group}.{name}.mesh.file", name, getattr(member.mesh, "file", None)
    for name, curve in case.curves.items():
        yield f"curves.{name}.csv", name, curve.csv


# ------------------------------------------------------------------------------------------- what stands there already


def _copies(case: Case, out: Path) -> Iterator[Path]:
    """Paths of the copies of meshes and curves, except those that are the originals themselves."""
    for _, given, kept in _files(case):
        if (case.folder / given).resolve() != (out / kept).resolve():
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
    found += [*_fields(out / "fields"), *_fields(out / "failure" / "fields")]
    found += [out / "failure" / name for name in ("case.yaml", "failure.json")]
    listed = out / "pictures" / PICTURE_LIST
    if listed.is_file():
        names = listed.read_text(encoding="utf-8").splitlines()
        found += [out / "pictures" / Path(name).name for name in names if name] + [listed]
    return found


def _checkpoints(folder: Path) -> list[Path]:
    return [path for path in folder.glob("checkpoint_*") if re.fullmatch(r"checkpoint_\d+\.h5(\.tmp)?", path.name)]


def _fields(folder: Path) -> list[Path]:
    """The collections, and the files of the parts that they name."""
    found: list[Path] = []
    for collection in folder.glob("*.pvd"):
        name = re.escape(collection.stem)
        steps = [path for path in folder.iterdir() if re.fullmatch(rf"{name}_\d{{6,}}\.vtu(\.tmp)?", path.name)]
        found += [*steps, collection] if steps else []
    return found
