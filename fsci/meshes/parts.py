"""The files that a mesh file names: parts of scripts, data of XDMF, parts of Abaqus, the other file of Tetgen."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fsci.meshes.scripts import GEOMETRY, GMSH, SCRIPT_TOKEN, is_mesh

XDMF = (".xdmf", ".xmf")
ABAQUS = (".inp",)

#: What names another file, by the ending of the file that does: HDF5 or raw data, and `*INCLUDE, INPUT=FILE`.
_NAMES = {
    **dict.fromkeys(XDMF, re.compile(rb">\s*([^<>\n]*?)\s*(?::[^<>\n]*?)?\s*</DataItem")),
    **dict.fromkeys(ABAQUS, re.compile(rb"(?im)^[ \t]*\*include\b[^=\r\n]*=[ \t]*([^\r\n]*?)[ \t]*\r?$")),
}

#: The longest name of a file; texts that are longer are data.
_LONGEST = 4096


@dataclass(frozen=True)
class Named:
    """A file, and where its name stands in the file that names it; None: they belong together by their names."""

    file: Path
    span: tuple[int, int] | None = None  #: of bytes


def all_files(path: Path) -> dict[Path, list[Named]]:
    """A mesh file and all files that it needs, each with those that it names. Files that do not exist are left out.

    Folders are absolute and without links.
    """
    find = _of_script if path.suffix in GMSH else _of_format
    found: dict[Path, list[Named]] = {}
    waiting = [real(path)]
    while waiting:
        one = waiting.pop()
        if one not in found and one.is_file():
            found[one] = [Named(real(named.file), named.span) for named in find(one)]
            waiting += [named.file for named in found[one]]
    return found


def real(path: Path) -> Path:
    """The path of a file through folders that are absolute and no links; the file itself may be one."""
    return path.parent.resolve() / path.name


def beside(path: Path) -> bool:
    """Whether names in a file of XDMF or Abaqus count from its folder, as they should, and not from the present one."""
    pattern = _NAMES.get(path.suffix.lower())
    return pattern is not None and all(_exists(path.parent, name) for _, name in _matches(path, pattern))


def _of_script(path: Path) -> Iterator[Named]:
    """Any text in a script that is the name of a file counts: besides Include and Merge there are fields and shapes."""
    yield from _of_the_same_name(path, path.with_name(path.name + ".opt"))
    if path.suffix.lower() in GEOMETRY or is_mesh(path):
        return
    for match in SCRIPT_TOKEN.finditer(path.read_bytes().decode("latin-1")):
        if match.lastgroup == "text" and _exists(path.parent, name := _decoded(match.group()[1:-1])):
            yield Named(path.parent / name, (match.start() + 1, match.end() - 1))


def _of_format(path: Path) -> Iterator[Named]:
    ending = path.suffix.lower()
    if ending in (".node", ".ele"):
        yield from _of_the_same_name(path, path.with_suffix(".node"), path.with_suffix(".ele"))
    elif ending == ".xml":  # values of cells in files of DOLFIN
        yield from _of_the_same_name(path, *path.parent.glob(f"{path.stem}_*.xml"))
    elif pattern := _NAMES.get(ending):
        for span, text in _matches(path, pattern):
            folder = next((folder for folder in (path.parent, Path()) if _exists(folder, text)), None)
            if folder is not None:
                yield Named(folder / text, span)


def _of_the_same_name(path: Path, *others: Path) -> Iterator[Named]:
    yield from (Named(other) for other in others if other != path and other.is_file())


def _matches(path: Path, pattern: re.Pattern[bytes]) -> Iterator[tuple[tuple[int, int], str]]:
    for match in pattern.finditer(path.read_bytes()):
        if 0 < len(match[1]) <= _LONGEST:
            yield match.span(1), match[1].decode("utf-8", "surrogateescape")


def _decoded(text: str) -> str:
    """The name of a file whose bytes were read as Latin-1."""
    return text.encode("latin-1").decode("utf-8", "surrogateescape")


def _exists(folder: Path, name: str) -> bool:
    try:
        return bool(name.strip()) and (folder / name).is_file()
    except (OSError, ValueError):  # no name at all: a text with a zero byte, or too long
        return False
