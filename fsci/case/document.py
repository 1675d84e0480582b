"""A case file as plain data with overrides, and the position of every setting."""

from __future__ import annotations

import io
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fsci.case.errors import CaseError, Place, Problem
from fsci.case.yaml_text import Keys, Parsed, parse_yaml


@dataclass(frozen=True)
class Document:
    """The settings of one case, overrides applied."""

    path: Path  #: as the user gave it
    text: str
    overrides: tuple[tuple[str, str], ...] = ()  #: dotted name, value as YAML text
    parsed: Parsed = field(default_factory=Parsed, repr=False)

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
        lines = self.text.split("\n")
        line = lines[place.line - 1].rstrip() if 0 < place.line <= len(lines) else ""
        return Problem(place, message, line)

    def dump(self) -> str:
        """The text of the case with its overrides; comments stay."""
        if not self.overrides:
            return self.text
        from ruamel.yaml import YAML

        yaml = YAML()
        yaml.preserve_quotes = True
        yaml.width = 4096  # no line is broken that was not
        data = yaml.load(self.text)
        for dotted, text in self.overrides:
            *_, (inner, last) = _steps(data, dotted)
            inner[last] = YAML().load(text)
        stream = io.StringIO()
        yaml.dump(data, stream)
        return stream.getvalue()


#: Size [bytes] of a case file: the reader takes a minute for more.
MOST_BYTES = 1_000_000


def read_document(path: Path) -> Document:
    """Read a case file; raises CaseError."""
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            raise CaseError([Problem(Place(str(path)), "is not a file")])
        with path.open("rb") as file:
            raw = file.read(MOST_BYTES + 1)
        if len(raw) > MOST_BYTES:
            raise CaseError([Problem(Place(str(path)), f"the file is larger than {MOST_BYTES // 1_000_000} MB")])
        text = raw.decode("utf-8-sig").replace("\r\n", "\n")
    except (OSError, ValueError) as error:
        place, reason = Place(str(path)), "cannot be read"
        if isinstance(error, UnicodeDecodeError):
            before = error.object[: error.start].decode("utf-8")
            place = Place(str(path), before.count("\n") + 1, len(before) - before.rfind("\n"))
            reason = "the file is not UTF-8 text"
        elif isinstance(error, OSError):
            reason += f": {error.strerror}"
        raise CaseError([Problem(place, reason)]) from None
    return Document(path, text, parsed=parse_yaml(text, str(path)))


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
    return Document(document.path, document.text, (*document.overrides, (dotted, text)), parsed)


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
