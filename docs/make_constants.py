"""Table of all constants, with their comments: python docs/make_constants.py > docs/reference/constants.md."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PACKAGES = ("solvers", "coupling")
#: a name in a kernel with a value in which a number is, and what stands behind it
IN_KERNELS = re.compile(r"\s*(?:static )?constexpr double (\w+) = ([^;{]*\b\d[^;{]*);\s*(?://\s*(.*))?")

INTRODUCTION = """\
# Constants

Each number with a name in `solvers/` and `coupling/`, made from the code by `docs/make_constants.py`. The last column
is its comment: what it is, where it comes from, or between which values results are the same. Tests vary many of them
(`tests/fields/test_constants.py`). Settings of the case file are in the [input reference](case.md).

| constant | value | what it is, and why so |
|---|---|---|"""


class Constant(NamedTuple):
    """A number, or several, with a name at the top of a file."""

    file: str  #: relative to the repository
    name: str
    value: str
    why: str  #: its comment, empty if it has none


def constants() -> list[Constant]:
    """Those of all files, in the order of files and lines."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*"))]
    return [one for path in paths for one in of_file(path)]


def of_file(path: Path) -> Iterator[Constant]:
    """Those of a file of Python or of a kernel."""
    found = {".py": in_python, ".hpp": in_kernel, ".cpp": in_kernel}.get(path.suffix)
    if found is not None:
        name = path.relative_to(ROOT).as_posix()
        yield from (Constant(name, *one) for one in found(path.read_text()))


def in_python(text: str) -> Iterator[tuple[str, str, str]]:
    """Name, value and comment of numbers with public names at the top level."""
    lines = text.splitlines()
    for node, name, value in assigned(text):
        if has_number(value) and not name.startswith("_"):
            behind = re.search(r"#:?\s*(.*)$", lines[(node.end_lineno or node.lineno) - 1])
            why = [comment_above(lines, node.lineno - 1, "#"), behind[1] if behind else ""]
            yield name, ast.unparse(value), " ".join(filter(None, why))


def assigned(text: str) -> Iterator[tuple[ast.stmt, str, ast.expr]]:
    """(statement, name, value) of assignments to names in capitals at the top level; several in a line one by one."""
    for node in ast.parse(text).body:
        target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
        value = getattr(node, "value", None)
        pairs = [(target, value)]
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            pairs = list(zip(target.elts, value.elts, strict=True))
        for name, one in pairs:
            if isinstance(name, ast.Name) and one is not None and re.fullmatch(r"_?[A-Z][A-Z0-9_]+", name.id):
                yield node, name.id, one


def has_number(value: ast.expr) -> bool:
    """Whether a value is made of numbers: keys of a dictionary and members of structures do not count."""
    if isinstance(value, ast.Dict):
        return any(has_number(one) for one in value.values)
    if isinstance(value, ast.Tuple):
        return any(has_number(one) for one in value.elts)
    if isinstance(value, ast.Call):
        return any(has_number(one) for one in value.args)
    if isinstance(value, ast.BinOp):
        return has_number(value.left) or has_number(value.right)
    if isinstance(value, ast.UnaryOp):
        return has_number(value.operand)
    return isinstance(value, ast.Constant) and type(value.value) in (int, float)


def in_kernel(text: str) -> Iterator[tuple[str, str, str]]:
    """The same of floating-point constants in C++."""
    lines = text.splitlines()
    for index, line in enumerate(lines):
        if found := IN_KERNELS.fullmatch(line):
            yield found[1], found[2], found[3] or comment_above(lines, index, "//")


def comment_above(lines: list[str], index: int, mark: str) -> str:
    """The text of the lines of comment before a line."""
    above: list[str] = []
    while index > 0 and lines[index - 1].lstrip().startswith(mark):
        index -= 1
        above.insert(0, lines[index].lstrip().lstrip("#:/ ").strip())
    return " ".join(above)


def page() -> str:
    """The page in Markdown: one table, with a line for each file."""
    rows, file = [INTRODUCTION], ""
    for one in constants():
        if one.file != file:
            file = one.file
            rows.append(f"| **`{file}`** | | |")
        why = one.why.replace("|", "\\|").replace("<", "\\<")
        rows.append(f"| `{one.name}` | `{one.value}` | {why} |")
    return "\n".join(rows)


if __name__ == "__main__":
    print(page())
