"""All settings of a case as plain data, defaults included, and what differs between two cases."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from typing import Any

from fsci.case.case import Case
from fsci.case.curve import Curve
from fsci.case.flow_element import flow_element
from fsci.case.mesh import FileMesh
from fsci.case.section import Section
from fsci.expression import Expression

#: Nested names with numbers, texts, truth values, None and lists at the ends; entries of lists that are sections have
#: their numbers as names. JSON keeps it as it is.
Settings = dict[str, Any]

Keys = tuple[str | int, ...]

#: Values that mean that nothing is set.
_NONE: tuple[Any, ...] = (None, {}, [])

#: Characters of a value in messages.
_WIDTH = 60


def settings_of(case: Case) -> Settings:
    """The settings of a case. Files count by what the case has read from them, and meshes not at all.

    The element of a flow is the one that it has, also where the program chooses it.
    """
    found: Settings = _plain(case)
    if case.fluid is not None:
        found["fluid"]["element"] = flow_element(case).element
    return found


def _plain(value: Any) -> Any:
    match value:
        case Curve(csv=str()):
            points = value.points
            return {"csv": f"{len(points)} points, checksum {zlib.crc32(points.tobytes()):08x}", "smooth": value.smooth}
        case Section():
            fields = type(value).model_fields.items()
            hidden = {"file"} if isinstance(value, FileMesh) else set()
            return {field.alias or name: _plain(getattr(value, name)) for name, field in fields if name not in hidden}
        case dict():
            return {name: _plain(inner) for name, inner in value.items()}
        case list() | tuple() if any(isinstance(inner, Section) for inner in value):
            return {str(number): _plain(inner) for number, inner in enumerate(value)}
        case list() | tuple():
            return [_plain(inner) for inner in value]
        case Expression():
            return value.text if value.constant is None else float(value.constant)
    return value


def differences(old: Any, new: Any, keys: Keys = ()) -> Iterator[tuple[Keys, Any, Any]]:
    """(setting, old value, new value) of all that differs; None: not set."""
    if isinstance(old, dict) and isinstance(new, dict):
        for name in old | new:
            key = int(name) if name.isdigit() else name
            yield from differences(old.get(name), new.get(name), (*keys, key))
    elif old != new and not (old in _NONE and new in _NONE):
        yield keys, old, new


def dotted(keys: Keys) -> str:
    """The name of a setting as users write it."""
    return ".".join(map(str, keys))


def in_words(value: Any) -> str:
    """A value as messages show it, in the form of a case file."""
    text = _text(value)
    return text if len(text) <= _WIDTH else f"{text[: _WIDTH - 3]}..."


def _text(value: Any) -> str:
    if value in _NONE:
        return "not set"
    match value:
        case bool():
            return "true" if value else "false"
        case int() | float():
            return f"{value:.12g}"
        case list():
            return f"[{', '.join('null' if inner is None else _text(inner) for inner in value)}]"
        case dict() if next(iter(value)).isdigit():
            return _text(list(value.values()))
        case dict():
            return f"{{{', '.join(f'{name}: {_text(inner)}' for name, inner in value.items() if inner not in _NONE)}}}"
    return str(value)
