"""Parts of a case in files of their own: `include: FILE` in a section stands for the settings in the file.

Settings beside `include` win. A file with a list stands for the whole section.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fsci.case.errors import CaseError, Place, Problem
from fsci.case.plain_file import Unreadable, read_file
from fsci.case.yaml_text import MOST_VALUES, Keys, Parsed, parse_yaml

INCLUDE = "include"

#: Size [bytes] of a file: the reader takes a minute for more.
MOST_BYTES_OF_CASE = 1_000_000


def read_text(path: Path) -> str:
    """The text of a YAML file. Raises Unreadable, and CaseError where it is no text."""
    try:
        return read_file(path, MOST_BYTES_OF_CASE).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        before = error.object[: error.start].decode("utf-8")
        place = Place(str(path), before.count("\n") + 1, len(before) - before.rfind("\n"))
        raise CaseError([Problem(place, "the file is not UTF-8 text")]) from None


def read_parts(path: Path, text: str) -> tuple[Parsed, dict[str, str]]:
    """The settings of a text with those of the files that it includes, and their texts by the name of the file.

    path: of the text; names count from its folder. Raises CaseError.
    """
    texts: dict[str, str] = {}
    return _read(path, text, (path,), texts), texts


def _read(path: Path, text: str, around: tuple[Path, ...], texts: dict[str, str]) -> Parsed:
    parsed = parse_yaml(text, str(path))
    for keys in list(_includes(parsed.data)):
        place = parsed.values[(*keys, INCLUDE)]
        name, line = _at(parsed.data, keys)[INCLUDE], text.split("\n")[place.line - 1].rstrip()
        file = path.parent / name
        try:
            if any(file.resolve() == other.resolve() for other in around):
                chain = ", ".join(other.name for other in (*around, file))
                raise Unreadable(f"includes itself: {chain}")
            texts[str(file)] = read_text(file)
            part = _read(file, texts[str(file)], (*around, file), texts)
            _insert(parsed, keys, part)
        except (Unreadable, ValueError) as error:  # ValueError: a name with a zero byte
            raise CaseError([Problem(place, f"the included file '{name}' {error}", line)]) from None
    return parsed


def _includes(data: Any, keys: Keys = ()) -> Iterator[Keys]:
    """Paths of the sections that include a file, the inner ones first: a list takes the place of a section."""
    if isinstance(data, dict | list):
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from _includes(value, (*keys, key))
    if includes(data):
        yield keys


def includes(data: Any) -> bool:
    """Whether a section includes a file; something else called so is a name, as of a body."""
    return isinstance(data, dict) and isinstance(data.get(INCLUDE), str)


def joined(section: Mapping[str, Any], part: Any) -> Any:
    """What a section with `include` and the content of the file are together. Raises Unreadable."""
    own = {name: value for name, value in section.items() if name != INCLUDE}
    if isinstance(part, list) and not own:
        return part
    if not isinstance(part, dict):
        there = "a list, which cannot stand beside other settings" if isinstance(part, list) else "no section or list"
        raise Unreadable(f"has {there}")
    return {**part, **own}


def _insert(parsed: Parsed, keys: Keys, part: Parsed) -> None:
    """Put the settings of a file into the section that includes it."""
    section = _at(parsed.data, keys)
    whole = joined(section, part.data)
    if keys:
        _at(parsed.data, keys[:-1])[keys[-1]] = whole
    else:
        parsed.data = whole
    for name in ("keys", "values", "texts"):
        places = getattr(parsed, name)
        places.pop((*keys, INCLUDE), None)
        new = {(*keys, *path): place for path, place in getattr(part, name).items() if path and path[0] not in section}
        places.update(new)
    if len(parsed.values) > MOST_VALUES:
        raise Unreadable(f"makes more than {MOST_VALUES} values of the case; put tables into files")


def _at(data: Any, keys: Keys) -> Any:
    for key in keys:
        data = data[key]
    return data
