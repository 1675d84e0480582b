"""The case in a results folder: its text and copies of all files that it names, so that the folder can be moved."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Any

from fsci.case import Case, load_case
from fsci.meshes.parts import Named, all_files, real
from fsci.running.files import FILES, FOLDERS, LOCK, MARKER, UNFINISHED, copy_file, make_folder, replacing, write_text

#: Names that copies cannot have at the top of a results folder, as file systems that ignore case see them.
RESERVED_FILES = {name.casefold() for name in (*FILES, *FOLDERS, MARKER, LOCK)}

Targets = dict[Path, Path]  #: file -> name of its copy in the folder


def keep_case(case: Case, folder: Path) -> None:
    """Write case.yaml and the files it names, such that the folder can be moved and run again."""
    folder.mkdir(parents=True, exist_ok=True)
    changes = []
    for setting, given, files, targets in _placed(case):
        kept = targets[real(case.folder / given)]
        if Path(given) != kept:
            changes.append((setting, json.dumps(kept.as_posix())))
        for file, names in files.items():
            _copy(file, names, targets, folder)
    write_text(folder / "case.yaml", case.dump(changes))


def kept_case(case: Case, folder: Path) -> Case:
    """The case that `keep_case` has written, with the positions of settings in the file of the user."""
    return load_case(folder).with_places_of(case)


def copies(case: Case) -> Iterator[tuple[Path, Path]]:
    """(file, name of its copy in a results folder) of all files that the case names."""
    for *_, targets in _placed(case):
        yield from targets.items()


def _placed(case: Case) -> Iterator[tuple[str, str, dict[Path, list[Named]], Targets]]:
    """(setting, its file, that file with those that it names, their copies) of meshes and curves in files.

    Settings have dots between their names. Copies have the names of the files in the folder of the case, as long as all
    of a mesh are in that folder and have no names of results. Others are in a folder of the name of the body, obstacle
    or curve, with a number if it is taken.
    """
    home, placed, taken = case.folder.resolve(), dict[Path, Targets](), Targets()  # taken: by names without case
    named = [(setting, name, given, _files(case, setting, given)) for setting, name, given in _named_files(case)]
    for *_, files in named:
        if all(file.is_relative_to(home) for file in files):
            targets = {file: file.relative_to(home) for file in files}
            if not any(map(_reserved, targets.values())) and _free(targets, taken):
                placed[next(iter(files))] = targets
                taken |= {_folded(kept): file for file, kept in targets.items()}
    for setting, name, given, files in named:
        source = next(iter(files))
        if source not in placed:
            kind = "curves" if setting.startswith("curves.") else "meshes"
            tries = (_together(files, Path(kind, numbered)) for numbered in _numbered(name))
            placed[source] = targets = next(targets for targets in tries if _free(targets, taken))
            taken |= {_folded(kept): file for file, kept in targets.items()}
        yield setting, given, files, placed[source]


def _files(case: Case, setting: str, given: str) -> dict[Path, list[Named]]:
    """The file of a setting, first, and those that it names."""
    source = real(case.folder / given)
    return {source: []} | ({} if setting.startswith("curves.") else all_files(source))


def _named_files(case: Case) -> Iterator[tuple[str, str, str]]:
    """(setting, name of what it is for, file) of the meshes of bodies and obstacles, and of curves, in files."""
    groups: dict[str, Mapping[str, Any]] = {
        "structure.bodies": case.elastic_bodies,
        "fluid.bodies": {} if case.fluid is None else case.fluid.bodies,
        "rigid.bodies": {} if case.rigid_section is None else case.rigid_section.bodies,
        "contact.obstacles": {} if case.contact is None else case.contact.obstacles,
    }
    found = [
        (f"{group}.{name}.mesh.file", name, getattr(member.mesh, "file", None))
        for group, members in groups.items()
        for name, member in members.items()
    ]
    found += [(f"curves.{name}.csv", name, curve.csv) for name, curve in case.curves.items()]
    yield from ((setting, name, given) for setting, name, given in found if given is not None)


def _reserved(kept: Path) -> bool:
    names = {kept.parts[0].casefold(), kept.name.casefold()}
    return kept.parts[0].casefold() in RESERVED_FILES or any(name.endswith(UNFINISHED) for name in names)


def _free(targets: Targets, taken: Targets) -> bool:
    """No copy has the name of another one's file or folder."""
    for file, kept in targets.items():
        name = _folded(kept)
        if taken.get(name, file) != file or any(name in other.parents or other in name.parents for other in taken):
            return False
    return True


def _folded(path: Path) -> Path:
    return Path(str(path).casefold())


def _numbered(name: str) -> Iterator[str]:
    yield from (f"{name}_{number}" if number > 1 else name for number in count(1))


def _together(files: dict[Path, list[Named]], folder: Path) -> Targets:
    """Copies in one folder: the first file with those in its folder, and a folder for each other one's."""
    home = next(iter(files)).parent
    targets = {file: folder / file.relative_to(home) for file in files if file.is_relative_to(home)}
    for other in dict.fromkeys(file.parent for file in files if file not in targets):
        used = {kept.relative_to(folder).parts[0].casefold() for kept in targets.values()}
        own = next(name for name in _numbered(other.name or "files") if name.casefold() not in used)
        targets |= {file: folder / own / file.name for file in files if file.parent == other}
    return targets


def _copy(file: Path, names: list[Named], targets: Targets, folder: Path) -> None:
    """Copy a file; names of other files in it become those of their copies."""
    target = folder / targets[file]
    if target.exists() and not target.is_symlink() and file.samefile(target):
        return
    for above in reversed(targets[file].parents[:-1]):
        make_folder(folder / above)
    moved = [named for named in names if named.span is not None]
    if not moved:
        copy_file(file, target)
        return
    content = file.read_bytes()
    for named in sorted(moved, key=lambda one: one.span or (0, 0), reverse=True):
        assert named.span is not None
        begin, end = named.span
        kept = os.path.relpath(targets[named.file], targets[file].parent).encode("utf-8", "surrogateescape")
        if os.path.normpath(content[begin:end]) != kept:
            content = content[:begin] + kept + content[end:]
    with replacing(target) as unfinished:
        unfinished.write_bytes(content)
