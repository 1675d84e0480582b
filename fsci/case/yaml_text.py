"""YAML 1.2 text as plain data, with the position of every key and value."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import CollectionNode, MappingNode, Node, ScalarNode

from fsci.case.errors import CaseError, Place, Problem

Keys = tuple[str | int, ...]  #: path of a setting, such as ("structure", "bodies", "flag", "supports", 0, "on")

#: Settings and list entries of a case, counted again wherever an alias repeats them. Long tables belong into files.
#: Each takes about 0.1 ms and 1 kB. The largest of `cases/` has 250, and 200,000 would take 20 s: from 1,000 to 200,000
#: any limit does the same, refuse what is not meant to be a case.
MOST_VALUES = 20_000

#: Message of the YAML reader -> message for the author of a case file; the first match applies.
PLAIN_WORDS = {
    "found character '\\t'": "a tab cannot stand here; indent with spaces",
    "mapping values are not allowed here": "unexpected ':'; check the indentation, and quote a text with ': ' in it",
    "sequence entries are not allowed here": "a list written with '-' must begin on a line of its own",
    "expected <block end>, but found '<block": "the indentation does not match the lines above",
    "expected <block end>, but found '<scalar>'": "this text does not belong here; check quotes and indentation",
    "expected <block end>": "this does not belong here; check the indentation",
    "could not find expected ':'": "':' is missing after the name of a setting",
    "but found '<stream end>'": "the text ends before the value is complete",
    "expected the node content": "this bracket does not belong here",
    "but found another document": "a case file has only one document; remove the line '---'",
    "expected '<document start>'": "this does not belong here; check the indentation",
    "mapping keys are not allowed here": "'?' does not belong here",
    "expected alphabetic or numeric character": "'&' and '*' need a name, or the value quotes",
    "expected chomping or indentation indicators": "put a value that begins with '|' or '>' in quotes",
    "expected a comment or a line break": "put a value that begins with '|' or '>' in quotes",
    "expected URI": "put a value that begins with '!' in quotes",
    "that cannot start any token": "a value cannot begin with this character; put it in quotes",
    "found undefined alias": "there is no section marked with '&' and this name",
}
#: The same for brackets and quotes that are not closed; the position is that of the opening one.
UNCLOSED = {
    "expected ',' or ']'": "this list needs ',' or ']'",
    "expected ',' or '}'": "this section needs ',' or '}'",
    "found unexpected end of stream": "this quote is not closed",
}


@dataclass
class Parsed:
    """The data of a text with the positions of its keys and values."""

    data: Any = None  #: nested dict (keys are always text), list, str, int, float, bool, None
    keys: dict[Keys, Place] = field(default_factory=dict)  #: names of settings
    values: dict[Keys, Place] = field(default_factory=dict)  #: values; () is the whole
    texts: dict[Keys, Place] = field(default_factory=dict)  #: first character of texts on one line without escapes


def parse_yaml(text: str, source: str) -> Parsed:
    """Read a text. Raises CaseError with positions in `source`."""
    reader = _Reader(text, source)
    try:
        node = YAML(typ="safe", pure=True).compose(text)
        if node is not None:
            reader.parsed.data = reader.read(node, ())
    except MarkedYAMLError as error:
        message, opened = _plain(error.problem or "")
        mark = (opened and error.context_mark) or error.problem_mark or error.context_mark
        raise reader.error(mark.line, mark.column, message) from None
    except YAMLError as error:
        before = text[: getattr(error, "position", 0)]
        line, column = before.count("\n"), len(before) - before.rfind("\n") - 1
        raise reader.error(line, column, "this character is not allowed in YAML") from None
    except RecursionError:
        raise reader.error(0, 0, "the settings are nested too deeply") from None
    return reader.parsed


def _plain(problem: str) -> tuple[str, bool]:
    """The problem in plain words, and whether something opened is not closed."""
    for pattern, words in (UNCLOSED | PLAIN_WORDS).items():
        if pattern in problem:
            return words, pattern in UNCLOSED
    return f"not valid YAML: {problem}", False


class _Reader:
    """Converts YAML nodes to data and stores their positions."""

    def __init__(self, text: str, source: str):
        self.text, self.source = text, source
        self.parsed = Parsed()
        self.open: list[CollectionNode] = []  # sections and lists around the current node
        self.count = 0  # values read so far

    def error(self, line: int, column: int, message: str) -> CaseError:
        """`line` and `column` count from 0, as YAML marks do."""
        lines = self.text.split("\n")
        text = lines[line].rstrip() if line < len(lines) else ""
        return CaseError([Problem(Place(self.source, line + 1, column + 1), message, text)])

    def fail(self, node: Node, message: str) -> CaseError:
        return self.error(node.start_mark.line, node.start_mark.column, message)

    def place(self, node: Node) -> Place:
        return Place(self.source, node.start_mark.line + 1, node.start_mark.column + 1)

    def read(self, node: Node, keys: Keys) -> Any:
        self.parsed.values[keys] = place = self.place(node)
        self.count += 1
        if self.count > MOST_VALUES:
            raise self.fail(node, f"the case has more than {MOST_VALUES} values up to here; put tables into files")
        if isinstance(node, ScalarNode):
            quoted = node.style in ("'", '"')
            if not quoted and self.open and self.open[-1].flow_style and node.value.count("(") > node.value.count(")"):
                raise self.fail(node, f"'{node.value}' ends at ',': put a formula with ',' in quotes")
            begin = node.start_mark.index + quoted
            if self.text[begin : begin + len(node.value)] == node.value and "\n" not in node.value:
                self.parsed.texts[keys] = Place(place.source, place.line, place.column + quoted)
            return self.scalar(node)
        if any(node is around for around in self.open):
            raise self.fail(node, "this section contains itself")
        if _short(node.tag) not in ("!!map", "!!seq"):
            raise self.fail(node, f"the tag '{_short(node.tag)}' is not allowed in a case file")
        assert isinstance(node, CollectionNode)
        self.open.append(node)
        if isinstance(node, MappingNode):
            data: Any = self.section(node, keys)
        else:
            data = [self.read(item, (*keys, i)) for i, item in enumerate(node.value)]
        self.open.pop()
        return data

    def section(self, node: MappingNode, keys: Keys) -> dict[str, Any]:
        data: dict[str, Any] = {}
        lines: dict[str, int] = {}
        # settings of the section itself come after inherited ones, and replace them
        for key, value in sorted(node.value, key=lambda item: not _inherits(item[0])):
            if _inherits(key):
                data |= self.inherited(key, value, keys)
                continue
            if not isinstance(key, ScalarNode):
                raise self.fail(key, "the name of a setting must be a plain word")
            name = str(key.value)
            if name in lines:
                raise self.fail(key, f"'{name}' is set twice, first in line {lines[name]}")
            lines[name] = key.start_mark.line + 1
            self.parsed.keys[(*keys, name)] = self.place(key)
            data[name] = self.read(value, (*keys, name))
        return data

    def inherited(self, key: Node, value: Node, keys: Keys) -> dict[str, Any]:
        """`<<: *other`: the settings of another section, or of a list of them, the first being the strongest."""
        data: dict[str, Any] = {}
        for other in [value] if isinstance(value, MappingNode | ScalarNode) else reversed(value.value):
            if not isinstance(other, MappingNode):
                raise self.fail(key, "'<<' takes a section or a list of sections")
            data |= self.read(other, keys)
        return data

    def scalar(self, node: ScalarNode) -> str | int | float | bool | None:
        kind, text = _short(node.tag), str(node.value)
        try:
            match kind:
                case "!!str" | "!!timestamp":
                    return text
                case "!!null":
                    return None
                case "!!bool":
                    return text.lower() in ("true", "yes", "on")
                case "!!int":
                    return _whole(text.replace("_", ""))
                case "!!float":
                    return float(text.replace("_", "").lower().replace(".inf", "inf").replace(".nan", "nan"))
        except ValueError:
            raise self.fail(node, f"'{text[:40]}' cannot be read as a number") from None
        raise self.fail(node, f"the tag '{kind}' is not allowed in a case file")


def _whole(text: str) -> int:
    return int(text, 0) if text.lstrip("+-")[:2].lower() in ("0x", "0o", "0b") else int(text)


def _inherits(key: Node) -> bool:
    return _short(key.tag) == "!!merge"


def _short(tag: object) -> str:
    return str(tag).replace("tag:yaml.org,2002:", "!!")
