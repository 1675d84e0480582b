"""The case in a results folder: its text and copies of all files that it names, so that the folder can be moved."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

from fsci.case import Case, load_case
from fsci.case.material import OwnLawSection
from fsci.meshes.parts import Named, all_files, real
from fsci.running.files import FILES, FOLDERS, LOCK, MARKER, UNFINISHED, copy_file, make_folder, replacing, write_text

#: Names that copies cannot have at the top of a results folder, as file systems that ignore case see them.
RESERVED_FILES = {name.casefold() for name in (*FILES, *FOLDERS, MARKER, LOCK)}

Targets = dict[Path, Path]  #: file -> name of its copy in the folder


class Given(NamedTuple):
    """A file that a setting names."""

    setting: str  #: with dots between its names
    of: str  #: name of the body, obstacle or curve
    folder: str  #: of copies that have no place of their own
    file: str  #: relative to the case file
    rest: str = ""  #: what follows it in the setting


def keep_case(case: Case, folder: Path) -> None:
    """Write case.yaml and the files it names, such that the folder can be moved and run again."""
    folder.mkdir(parents=True, exist_ok=True)
    changes = []
    for given, files, targets in _placed(case):
        kept = targets[real(case.folder / given.file)]
        if Path(given.file) != kept:
            changes.append((given.setting, json.dumps(kept.as_posix() + given.rest)))
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


def _placed(case: Case) -> Iterator[tuple[Given, dict[Path, list[Named]], Targets]]:
    """(file, that file with those that it names, their copies) of all files that settings name.

    Copies have the names of the files in the folder of the case, as long as all
    of a mesh are in that folder and have no names of results. Others are in a folder of the name of the body, obstacle
    or curve, with a number if it is taken.
    """
    home, placed, taken = case.folder.resolve(), dict[Path, Targets](), Targets()  # taken: by names without case
    named = [(given, _files(case, given)) for given in _given_files(case)]
    for _, files in named:
        if all(file.is_relative_to(home) for file in files):
            targets = {file: file.relative_to(home) for file in files}
            if not any(map(_reserved, targets.values())) and _free(targets, taken):
                placed[next(iter(files))] = targets
                taken |= {_folded(kept): file for file, kept in targets.items()}
    for given, files in named:
        source = next(iter(files))
        if source not in placed:
            tries = (_together(files, Path(given.folder, numbered)) for numbered in _numbered(given.of))
            placed[source] = targets = next(targets for targets in tries if _free(targets, taken))
            taken |= {_folded(kept): file for file, kept in targets.items()}
        yield given, files, placed[source]


def _files(case: Case, given: Given) -> dict[Path, list[Named]]:
    """The file of a setting, first, and those that it names."""
    source = real(case.folder / given.file)
    return {source: []} | (all_files(source) if given.folder == "meshes" else {})


def _given_files(case: Case) -> Iterator[Given]:
    """Of meshes, laws and curves."""
    groups: dict[str, Mapping[str, Any]] = {
        "structure.bodies": case.elastic_bodies,
        "fluid.bodies": {} if case.fluid is None else case.fluid.bodies,
        "rigid.bodies": {} if case.rigid_section is None else case.rigid_section.bodies,
        "contact.obstacles": {} if case.contact is None else case.contact.obstacles,
    }
    for group, members in groups.items():
        for name, member in members.items():
            if (file := getattr(member.mesh, "file", None)) is not None:
                yield Given(f"{group}.{name}.mesh.file", name, "meshes", file)
    for name, body in case.elastic_bodies.items():
        if isinstance(body.material, OwnLawSection):
            setting, rest = f"structure.bodies.{name}.material.law", f":{body.material.function}"
            yield Given(setting, name, "laws", body.material.file, rest)
    for name, curve in case.curves.items():
        if curve.csv is not None:
            yield Given(f"curves.{name}.csv", name, "curves", curve.csv)


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
