"""A case file as plain data with overrides, and the position of every setting."""

from __future__ import annotations

import io
import json
import warnings
from collections import Counter
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML, YAMLError
from ruamel.yaml.anchor import Anchor
from ruamel.yaml.comments import merge_attrib

from fsci.case.errors import CaseError, Place, Problem
from fsci.case.include import INCLUDE, includes, read_parts, read_text
from fsci.case.plain_file import Unreadable
from fsci.case.yaml_text import Keys, Parsed, parse_yaml


@dataclass(frozen=True)
class Document:
    """The settings of one case, overrides applied."""

    path: Path  #: as the user gave it
    text: str
    overrides: tuple[tuple[str, str], ...] = ()  #: dotted name, value as YAML text
    parsed: Parsed = field(default_factory=Parsed, repr=False)
    parts: dict[str, str] = field(default_factory=dict, repr=False)  #: name of an included file -> its text

    @property
    def data(self) -> Any:
        return self.parsed.data

    def place(self, keys: Keys) -> Place:
        """Position of a setting: its value if that is on the line of its key, else its key, else that of its parent."""
        while keys and keys not in self.parsed.values:
            keys = keys[:-1]
        value = self.parsed.values.get(keys, Place(str(self.path), 1, 1))
        key = self.parsed.keys.get(keys, value)
        return value if (value.source, value.line) == (key.source, key.line) else key

    def key_place(self, keys: Keys) -> Place:
        """Position of the name of a setting; for the entry of a list or the whole file, its beginning."""
        return self.parsed.keys.get(keys) or self.place(keys)

    def text_place(self, keys: Keys, column: int) -> Place:
        """Position of the column-th character (from 1) of a text, or of the text if the file writes it otherwise."""
        first = self.parsed.texts.get(keys)
        if first is None or not first.line:
            return self.place(keys)
        return Place(first.source, first.line, first.column + column - 1)

    def problem(self, place: Place, message: str) -> Problem:
        lines = self.parts.get(place.source, self.text).split("\n")
        line = lines[place.line - 1].rstrip() if 0 < place.line <= len(lines) else ""
        return Problem(place, message, line)

    def dump(self) -> str:
        """The text of the case with included files and overrides in it.

        Comments beside settings stay, as far as the text then means these settings.
        """
        if not self.overrides and not self.parts:
            return self.text
        return next(text for write in (_with_comments, _plainly) if (text := write(self)) and self._is(text))

    def _is(self, text: str) -> bool:
        """Whether a text has the settings of this case, in whatever order; a number that is none equals itself."""
        try:
            other = parse_yaml(text, str(self.path)).data
        except CaseError:
            return False
        return json.dumps(other, sort_keys=True) == json.dumps(self.data, sort_keys=True)


def _with_comments(document: Document) -> str:
    """The text with its comments. Anchors may get in the way: then it is empty, or has other settings."""
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 4096  # no line is broken that was not
    try:
        with warnings.catch_warnings(action="ignore"):  # of anchors of one name, which YAML allows
            data = _whole(document, document.path, yaml.load(document.text), yaml)
        for dotted, text in document.overrides:
            _unshare(data, dotted)
            *_, (inner, last) = _steps(data, dotted)
            inner[last] = YAML().load(text)
        return _written(yaml, data)
    except (YAMLError, LookupError, TypeError, ValueError, AttributeError):
        return ""


def _whole(document: Document, path: Path, data: Any, yaml: YAML) -> Any:
    """The data of a file with those of included files in it; a section of the file with more settings stays first."""
    for key in list(data) if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ():
        inner = data[key]
        if isinstance(inner, dict | list) and (whole := _whole(document, path, inner, yaml)) is not inner:
            data[key] = whole
    if not includes(data):
        return data
    file = path.parent / data[INCLUDE]
    part = _whole(document, file, yaml.load(document.parts[str(file)]), yaml)
    if len(data) == 1:
        return part
    for name, value in part.items():
        data.setdefault(name, value)
    del data[INCLUDE]
    return data


def _unshare(data: Any, dotted: str) -> None:
    """Replace the sections around a setting that others share, by an alias or by `<<`, with copies of their own."""
    shared = _uses(data)
    for word in dotted.split(".")[:-1]:
        key: Any = int(word) if isinstance(data, list) else word
        inner = data[key] if isinstance(data, list) else data.get(key)
        if not isinstance(inner, dict | list):
            return
        if shared[id(inner)] > 1:
            data[key] = inner = deepcopy(inner)
            for node in _nodes(inner):
                node.__dict__.pop(Anchor.attrib, None)
            shared = Counter()  # all of the copy is its own
        data = inner


def _uses(data: Any) -> Counter[int]:
    """How often each section and list, by its identity, is part of the data."""
    return Counter(id(node) for node in _nodes(data))


def _nodes(data: Any) -> Iterator[Any]:
    if isinstance(data, dict | list):
        yield data
        for value in data.values() if isinstance(data, dict) else data:
            yield from _nodes(value)
        for other in getattr(data, merge_attrib, ()):  # as many as `<<` names
            yield other[1] if isinstance(other, tuple) else other


def _plainly(document: Document) -> str:
    """The settings alone."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style, yaml.sort_base_mapping_type_on_output = False, False  # type: ignore[assignment]
    yaml.width = 4096
    return _written(yaml, document.data)


def _written(yaml: Any, data: Any) -> str:
    stream = io.StringIO()
    yaml.dump(data, stream)
    return stream.getvalue()


def read_document(path: Path) -> Document:
    """Read a case file and those that it includes; raises CaseError."""
    try:
        text = read_text(path)
    except Unreadable as error:
        raise CaseError([Problem(Place(str(path)), str(error))]) from None
    parsed, parts = read_parts(path, text)
    return Document(path, text, parsed=parsed, parts=parts)


def override(document: Document, dotted: str, text: str) -> Document:
    """The document with one setting replaced or added; `text` is read as YAML. Raises CaseError."""
    here = Place(f"--set {dotted}={text}")
    data = deepcopy(document.data)
    try:
        new = parse_yaml(text, here.source)
        steps = list(_steps(data, dotted))
    except CaseError as error:
        raise CaseError([Problem(here, problem.message) for problem in error.problems]) from None
    except KeyError as error:
        raise CaseError([Problem(here, error.args[0])]) from None
    inner, last = steps[-1]
    inner[last] = new.data
    keys = tuple(key for _, key in steps)
    parsed = Parsed(data)
    for name in ("keys", "values", "texts"):
        old_places, new_places = getattr(document.parsed, name), getattr(new, name)
        # sections that the override creates have its position
        places = dict.fromkeys((keys[:n] for n in range(1, len(keys) + 1)), here) if name != "texts" else {}
        places |= {path: place for path, place in old_places.items() if path[: len(keys)] != keys}
        places |= {keys + path: here for path in new_places}
        setattr(parsed, name, places)
    return replace(document, overrides=(*document.overrides, (dotted, text)), parsed=parsed)


def _steps(data: Any, dotted: str) -> list[tuple[Any, str | int]]:
    """Sections and lists from the outermost to the one that holds the setting, each with the key to follow.

    Sections that are absent are made. Raises KeyError with a message.
    """
    steps: list[tuple[Any, str | int]] = []
    words = dotted.split(".")
    for count, word in enumerate(words):
        where = f"'{'.'.join(words[:count])}'" if count else "the case"
        key: str | int = word
        if isinstance(data, list):
            if word not in map(str, range(len(data))):
                raise KeyError(f"{where} is a list with entries 0 to {len(data) - 1} and has no entry '{word}'")
            key = int(word)
        elif not isinstance(data, dict):
            raise KeyError(f"{where} is not a section, it has no setting '{word}'")
        elif not word:
            raise KeyError("write names separated by single dots")
        elif count < len(words) - 1 and data.get(word) is None:
            data[word] = {}
        steps.append((data, key))
        if count < len(words) - 1:
            data = data[key]
    return steps
