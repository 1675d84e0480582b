"""Sections of the text of a case: lines of a key and of all that is indented below it, comments and places kept."""

from __future__ import annotations


def section(text: str, *path: str) -> str:
    """The lines of a section, such as ("structure", "bodies"); raises KeyError if there is none."""
    first, last = _span(text, path)
    return "".join(text.splitlines(keepends=True)[first:last])


def with_section(text: str, new: str, *path: str) -> str:
    """The text with other lines in the place of a section."""
    lines, (first, last) = text.splitlines(keepends=True), _span(text, path)
    return "".join([*lines[:first], new, *lines[last:]])


def without(text: str, *path: str) -> str:
    """The text without the lines of a section."""
    return with_section(text, "", *path)


def _span(text: str, path: tuple[str, ...]) -> tuple[int, int]:
    """First line of a section, and the line after its last one."""
    lines = text.splitlines()
    first, last, depth = 0, len(lines), -1
    for key in path:
        below = [i for i in range(first, last) if lines[i].lstrip().startswith(f"{key}:") and _depth(lines[i]) > depth]
        if not below:
            raise KeyError(".".join(path))
        first = min(below, key=lambda i: (_depth(lines[i]), i))
        depth = _depth(lines[first])
        ends = (i for i in range(first + 1, last) if lines[i].strip() and _depth(lines[i]) <= depth)
        last = next(ends, last)
    return first, last


def _depth(line: str) -> int:
    return len(line) - len(line.lstrip())
