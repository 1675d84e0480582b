"""Gmsh scripts of a case must not run programs or write files: commands that could are rejected before gmsh reads them.

Gmsh takes any file that is not of a known format for a script, whatever its name, and with FILE it reads FILE.opt.
The grammar is that of Gmsh.l and Gmsh.y in Gmsh's sources (4.15).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

#: Commands and fields that run a program.
RUNS = {"System", "SystemCall", "NonBlockingSystemCall", "OnelabRun", "ExternalProcess"}

#: Commands that write files or make folders.
WRITES = {"Save", "Print", "CreateDir"}

#: Functions that make names of texts, and so any command.
NAMES = {"StringToName", "S2N"}

READS = {"Include", "Merge", "MergeWithBoundingBox"}

#: Formats that gmsh recognises by their endings and reads without its parser.
GEOMETRY = {".stl", ".brep", ".brp", ".step", ".stp", ".iges", ".igs", ".xao", ".vtk", ".unv", ".med", ".bdf", ".ply"}

#: Endings of scripts, and of the files that gmsh reads here.
SCRIPTS = (".geo", ".geo_unrolled")
MESHES = (".msh", ".unv")
GMSH = (*SCRIPTS, *MESHES)

#: Characters of a text; gmsh's parser ends longer ones in the middle, after 1023.
LONGEST_TEXT = 1000

SCRIPT_TOKEN = re.compile(
    r"(?P<space>[ \t\r\f\n]+)|(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<text>\"[^\"]*\"|'[^']*')|(?P<open>/\*|[\"'])"
    r"|(?P<number>(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<other>.)",
    re.DOTALL,
)


class RefusedScript(Exception):
    """A script that could do more than make a mesh; the message has file and line."""


class Token(NamedTuple):
    kind: str  #: text, name, number or other
    text: str
    line: int


def require_harmless(path: Path) -> None:
    """Raises RefusedScript if gmsh could run a program or write a file when it reads this one."""
    _check(path, set(), script=path.suffix not in MESHES)


def _check(path: Path, seen: set[Path], *, script: bool) -> None:
    """A file with those that it reads; a `script` is parsed whatever it begins with."""
    if path in seen or not path.exists():
        return
    if not path.is_file():
        raise RefusedScript(f"{path.name} is not a file")
    seen.add(path)
    _check(path.with_name(path.name + ".opt"), seen, script=True)
    if path.suffix.lower() == ".gz":
        raise RefusedScript(f"{path.name}: gmsh runs a program to read a compressed file: unpack it")
    if not script and (path.suffix.lower() in GEOMETRY or is_mesh(path)):
        return
    text = path.read_bytes().decode("latin-1")
    tokens = list(_tokens(path, text))
    _require_line_break(path, text, tokens)
    for index, token in enumerate(tokens):
        if token.kind == "name":
            _check_word(path, tokens, index, seen)


def _require_line_break(path: Path, text: str, tokens: list[Token]) -> None:
    """Of a last line without a line break gmsh reads the first statement only, and says nothing."""
    last = [token for token in tokens if token.line == 1 + text.count("\n")]
    depths = accumulate((token.text == "{") - (token.text == "}") for token in last[:-1])
    if any(token.text == ";" and not depth for token, depth in zip(last, depths, strict=False)):
        raise RefusedScript(
            f"{path.name}:{last[0].line}: gmsh reads the first statement of this line only: put a line break at its end"
        )


def is_mesh(path: Path) -> bool:
    """Whether it is a mesh in gmsh's own format."""
    with path.open("rb") as file:
        return file.read(1) == b"$"


def _tokens(path: Path, text: str) -> Iterator[Token]:
    """Tokens without spaces and comments.

    Gmsh's loops and macros jump to the beginning of a line that follows code. So that none of these lies within a
    comment or a text, comments of several lines must have a first line of their own, and texts end in their line.
    """
    line, code_on_line = 1, False
    for match in SCRIPT_TOKEN.finditer(text):
        kind, word = str(match.lastgroup), match.group()
        if "\0" in word or kind == "open":
            raise RefusedScript(f"{path.name}:{line}: this comment or text has no end")
        if kind == "text" and ("\n" in word or len(word) > LONGEST_TEXT):
            limit = f"a text must end in its line, after {LONGEST_TEXT} characters at most"
            raise RefusedScript(f"{path.name}:{line}: {limit}")
        if kind == "comment" and "\n" in word and code_on_line:
            raise RefusedScript(f"{path.name}:{line}: a comment of several lines must begin on a line of its own")
        if kind not in ("space", "comment"):
            yield Token(kind, word, line)
        line += word.count("\n")
        code_on_line = kind not in ("space", "comment") or (code_on_line and "\n" not in word)


def _check_word(path: Path, tokens: list[Token], index: int, seen: set[Path]) -> None:
    word, line = tokens[index].text, tokens[index].line
    reason = ""
    if word in RUNS:
        reason = "runs a program"
    elif word in WRITES or (word == "Printf" and _sends_to_file(tokens[index + 1 :])):
        reason = "writes a file"
    elif word in NAMES:
        reason = "may name any command"
    if reason:
        what = "the mesh script of a case must not run programs or write files"
        raise RefusedScript(f"{path.name}:{line}: '{word}' {reason}: {what}")
    if word in READS:
        following = tokens[index + 1 : index + 3]
        if [token.kind for token in following] != ["text", "other"] or following[1].text != ";":
            raise RefusedScript(f"{path.name}:{line}: '{word}' needs the plain name of a file in quotes")
        _check(path.parent / following[0].text[1:-1], seen, script=word == "Include")


def _sends_to_file(rest: list[Token]) -> bool:
    """A '>' stands between the closing bracket of Printf(...) and the end of the command."""
    depth = 0
    for token in rest:
        depth += (token.text in "([") - (token.text in ")]") if token.kind == "other" else 0
        if token.text == ";":
            return False
        if token.text == ">" and depth == 0:
            return True
    return False
